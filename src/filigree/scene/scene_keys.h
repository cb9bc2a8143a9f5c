// Every key of a scene file in one table: what the reader checks by and what docs/scenes.md shows.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace filigree {

enum class KeyType {
    text,
    word,
    number,
    whole,
    flag,
    vector,
    points,
    keyed,
    keyed_number,
    color,
    box,
    ball,
    ids,
    rotation,
    repeat,
    pixels
};

struct KeyRule {
    std::string_view table, key;
    KeyType type;
    std::string_view unit;  ///< "" where there is none
    std::string_view unset; ///< what holds without it
    double least, most;     ///< of a number, both allowed unless `above`
    bool above;             ///< `least` itself is not allowed
    std::string_view words; ///< of a word, a space in between
    std::string_view only;  ///< obstacles: the shapes it belongs to; bodies: "shape" for keys of built-in shapes
    std::string_view text;
};

/// In the order of the manual, table by table.
std::span<const KeyRule> scene_keys();
/// The rule of a key, null where there is none.
const KeyRule* find_key(std::string_view table, std::string_view key);
/// "[[body]]" or "[world]".
std::string shown_table(std::string_view table);
bool is_list(std::string_view table); ///< one of those that may come several times

/// What of a number is allowed, as words: "above 0", "0 to 1"; "" for anything.
std::string range_text(const KeyRule& rule);
std::string type_text(KeyType type);

/// The tables of docs/scenes.md: every key with its type, unit, default and range, and the materials by name.
std::string scene_manual();

/// Of `words` the one most like `word`, "" when none is like it.
std::string most_alike(std::string_view word, std::span<const std::string_view> words);

} // namespace filigree
