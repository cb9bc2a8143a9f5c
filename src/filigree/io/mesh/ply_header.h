// What stands before the numbers of a PLY file: its elements, their properties, and how they are encoded.
#pragma once

#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/text_scanner.h"

#include <algorithm>

namespace filigree::ply {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

inline std::size_t size_of(Type type) {
    static constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return kBytes[static_cast<std::size_t>(type)];
}

struct Property {
    std::string name;
    Type type = Type::float32;
    std::optional<Type> list_count; ///< a list, with its length as this type
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;

    bool has_lists() const {
        return std::any_of(properties.begin(), properties.end(), [](const Property& p) { return p.list_count; });
    }
    /// Bytes of a binary row without lists.
    std::size_t row_bytes() const {
        std::size_t bytes = 0;
        for (const Property& p : properties) bytes += size_of(p.type);
        return bytes;
    }
    std::size_t find(std::string_view property) const {
        const auto same = [&](const Property& p) { return p.name == property; };
        return static_cast<std::size_t>(std::find_if(properties.begin(), properties.end(), same) - properties.begin());
    }
    bool has(std::string_view property) const { return find(property) < properties.size(); }
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
    Encoding encoding = Encoding::ascii;
    std::vector<Element> elements;

    const Element* find(std::string_view name) const {
        for (const Element& e : elements)
            if (e.name == name) return &e;
        return nullptr;
    }
};

/// The header, and where the body begins: the byte, and the line for messages.
struct HeaderAndBody {
    Header header;
    TextScanner body;
};

/// Errors: bad_file, with the line.
Result<HeaderAndBody> read_header(const MeshSource& source);

/// Which of these properties are the colour of a vertex, by the names that programs give them (red, r, diffuse_red,
/// Red): three, or four with the opacity; none where one of the three is missing. names: empty for what cannot be one.
std::vector<std::size_t> find_color(const std::vector<std::string>& names);

} // namespace filigree::ply
