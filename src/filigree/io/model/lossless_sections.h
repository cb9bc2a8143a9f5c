// The sections of a model file bit for bit: "ll.tab" is the table of the plain file, "ll.sec" k what its section k
// became. What a section is expected to hold follows from others: places from faces, records from both.
#pragma once

#include "filigree/pack/lossless_numbers.h"

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

struct FileSection;

/// What the code of one section takes from others. May be used by several threads.
class SectionGuide {
public:
    /// The bytes of a plain section; none where there is no such section.
    using Fetch = std::function<std::string(std::string_view name, std::uint32_t index)>;
    /// name, index: as FileSection has them.
    explicit SectionGuide(Fetch fetch) : fetch_(std::move(fetch)) {}

    /// A section's words of four bytes.
    std::vector<std::uint32_t> words(std::string_view name, std::uint32_t index = 0) const;
    std::string bytes(std::string_view name, std::uint32_t index) const { return fetch_(name, index); }
    /// Offsets of so many corners into faces, by "mesh" or "lev"; none where they do not fit.
    std::vector<Index> face_offsets(const std::string& name, std::uint32_t index, std::size_t corners) const;
    /// Where each vertex of the mesh is expected, from others of its chunk. Known once for all.
    const std::vector<Expectation>& vertices() const;
    /// The same from the corners of an attribute, for its values.
    std::vector<Expectation> values(const std::string& corners, std::size_t count) const;
    /// The same, for the driver's vertices. Known once for all.
    const std::vector<Expectation>& driver() const;

private:
    Fetch fetch_;
    mutable std::once_flag vertices_once_, driver_once_;
    mutable std::vector<Expectation> vertices_, driver_;
};

/// A section's bytes in as few as can be, the way they are written first.
std::string encode_section(const FileSection& section, std::string_view bytes, const SectionGuide& guide);
/// None: damaged. Memory is bounded by what the code's size can hold.
std::optional<std::string> decode_section(const FileSection& section, std::string_view code, const SectionGuide& guide);

} // namespace filigree
