// The syntax of USD text (.usda): prims and their attributes, whose values stay text until they are asked for.
#pragma once

#include "filigree/result.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filigree {

/// A piece of the file.
struct UsdValue {
    std::size_t begin = 0, end = 0; ///< bytes; equal: nothing
    std::size_t line = 0;           ///< of its first byte, from 1

    bool empty() const { return begin == end; }
};

struct UsdSample {
    double time = 0; ///< in time codes
    UsdValue value;
};

struct UsdAttribute {
    std::string_view name;          ///< with its namespaces: "xformOp:translate"
    UsdValue value;                 ///< outside of time; empty: none
    std::vector<UsdSample> samples; ///< by ascending time, without blocked ones (None)
    std::size_t line = 0;
};

struct UsdPrim {
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

    std::string_view specifier, type, name;
    std::size_t parent = kNone; ///< the prim around it
    std::size_t line = 0;
    bool active = true;
    std::vector<UsdAttribute> attributes;

    const UsdAttribute* find(std::string_view name) const;
};

/// Names and values refer to the text.
struct UsdLayer {
    std::vector<std::pair<std::string_view, UsdValue>> metadata; ///< of the layer
    std::vector<UsdPrim> prims;                                  ///< in the file's order, each after its parent
    /// The first thing that composes the scene of other prims or files: "references", "payload", "subLayers",
    /// "inherits", "specializes", "variantSet"; and its line.
    std::string_view composed_by;
    std::size_t composed_line = 0;

    /// Of the metadata; empty: it is not there.
    UsdValue find(std::string_view key) const;
};

/// Reads a layer. What it does not know it steps over by its brackets and quotes. Errors: bad_file, with a sentence
/// that begins with `name` and says the line. Cost O(bytes). Depth of prims and brackets: any.
Result<UsdLayer> read_usd_layer(std::string_view text, const std::string& name);

/// The numbers of a value, whatever brackets and commas are around them. Errors: bad_file, with the line.
Result<std::vector<double>> usd_numbers(std::string_view text, const UsdValue& value, const std::string& name);
/// The words in quotes of a value.
std::vector<std::string_view> usd_words(std::string_view text, const UsdValue& value);

} // namespace filigree
