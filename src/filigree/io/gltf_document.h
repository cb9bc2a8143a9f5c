// A glTF file's JSON, buffers and accessors: everything that is in the file is checked here, when it is asked for.
#pragma once

#include "filigree/context.h"
#include "filigree/io/gltf_component.h"
#include "filigree/result.h"
#include "filigree/types.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace filigree::gltf {

using Json = nlohmann::json;

/// What is wrong with a file, thrown inside the reader only and turned into an Error at its door.
struct Damage {
    std::string what; ///< "accessors[3].count: ...", without the file's name
    ErrorCode code = ErrorCode::bad_file;
};

/// A place in the document that may be empty, and the way to it for messages. Every question that the value cannot
/// answer is Damage.
class Value {
public:
    Value(const Json* json, std::string path) : json_(json), path_(std::move(path)) {}

    bool exists() const { return json_ != nullptr; }
    explicit operator bool() const { return exists(); }
    const std::string& path() const { return path_; }
    const Json& json() const { return *json_; }
    [[noreturn]] void fail(const std::string& why, ErrorCode code = ErrorCode::bad_file) const;

    /// A member of an object; does not exist where either of them does not.
    Value operator[](const std::string& member) const;
    Value operator[](const char* member) const { return (*this)[std::string(member)]; }
    /// Elements of an array, 0 where there is none.
    std::size_t size() const;
    Value operator[](std::size_t element) const;
    /// Names of an object's members; none where there is none.
    std::vector<std::string> members() const;

    double number() const; ///< finite
    double number(double otherwise) const { return exists() ? number() : otherwise; }
    std::size_t whole() const; ///< 0, 1, 2, ...
    std::size_t whole(std::size_t otherwise) const { return exists() ? whole() : otherwise; }
    std::size_t index(std::size_t count, const char* of) const; ///< below `count`
    bool flag(bool otherwise) const;
    std::string text() const;
    std::string text(const char* otherwise) const { return exists() ? text() : otherwise; }
    /// Exactly `count` numbers into `out`; false, and `out` as it was, where there is no value.
    bool numbers(double* out, std::size_t count) const;

private:
    const Json* json_;
    std::string path_;
};

using Component = GltfComponent;
std::size_t size_of(Component component);

/// Checked elements of numbers in a buffer. Views the document's bytes.
class Accessor {
public:
    std::size_t count = 0;
    std::size_t width = 0; ///< numbers an element: 1, 2, 3, 4, 16
    Component component = Component::float32;
    bool normalized = false;
    std::string path; ///< for messages

    /// Numbers of element `i` as they count: normalised ones from -1 or 0 to 1.
    void read(std::size_t i, double* out) const;
    double scalar(std::size_t i) const; ///< the first of them
    /// An integer as it stands.
    std::uint32_t integer(std::size_t i) const;
    /// Adds `weight` times the first three numbers of elements begin .. end - 1 to `sums`.
    void add_to(std::span<Vec3d> sums, std::size_t begin, std::size_t end, double weight) const;
    /// All of them as floats.
    void read_all(float* out) const;

private:
    friend class Document;
    const char* base_ = nullptr; ///< null: zeros
    std::size_t stride_ = 0;
    /// Elements that stand elsewhere, ascending.
    const char *sparse_indices_ = nullptr, *sparse_values_ = nullptr;
    std::size_t sparse_count_ = 0;
    Component sparse_component_ = Component::uint16;

    const char* element(std::size_t i) const; ///< null: zeros
    std::size_t sparse_index(std::size_t s) const;
    std::size_t first_sparse(std::size_t i) const;
    template <class T>
    void read_as(const char* from, double* out, std::size_t numbers) const;
    void read_from(const char* from, double* out, std::size_t numbers) const;
};

/// What an accessor must be to serve.
struct Wanted {
    std::vector<const char*> types;
    std::vector<Component> components;
};

/// The parsed file. Bytes and documents must outlive what it hands out.
class Document {
public:
    /// `bytes` must outlive the document. folder: where buffers and pictures are; self: the file's own path.
    Document(std::string_view bytes, std::filesystem::path folder, std::filesystem::path self);
    Document(const Document&) = delete;
    Document& operator=(const Document&) = delete;

    Value root() const { return {&json_, ""}; }
    /// An element of one of the document's arrays.
    Value item(const char* array, std::size_t i) const { return root()[array][i]; }
    std::size_t count(const char* array) const { return root()[array].size(); }

    /// Whether the accessor whose number `reference` is has numbers of the wanted kind.
    bool serves(const Value& reference, const Wanted& wanted) const;
    /// That accessor.
    Accessor accessor(const Value& reference, const Wanted& wanted);
    /// The bytes of an image (a URI or a buffer view): a PNG or JPEG file.
    std::string picture(std::size_t image);

    /// What buffers and images name that is not in the file itself.
    std::vector<std::string> files_beside() const;

    /// Counts what is read or made from the file. A file may repeat its parts, but not without end: Damage when that
    /// becomes far more than its bytes.
    void charge(std::size_t elements, const std::string& path);

private:
    std::string_view file_, binary_chunk_;
    bool has_binary_chunk_ = false;
    std::filesystem::path folder_, self_;
    Json json_;
    std::map<std::size_t, std::string> buffers_; ///< read from elsewhere
    std::size_t bytes_ = 0, charged_ = 0;

    std::string_view unpack_glb(std::string_view bytes);
    void check_header() const;
    std::string_view buffer(std::size_t number);
    struct View {
        std::string_view bytes;
        std::size_t stride = 0; ///< 0: none given
    };
    View view(const Value& reference);
    std::filesystem::path beside(const Value& uri, const std::string& name) const;
    /// At most `limit` bytes of it.
    std::string resource(const Value& uri, std::size_t limit) const;
    void read_sparse(const Value& sparse, std::size_t element_size, Accessor& accessor);
};

} // namespace filigree::gltf
