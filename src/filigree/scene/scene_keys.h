// Every key of a scene file: one row with the member that it fills, what it may be, and a sentence. The reader goes by
// these rows, and so do the tables of docs/scenes.md, `sweep`, the Python module and the studio.
#pragma once

#include "filigree/scene.h"

#include <string_view>
#include <variant>

namespace filigree {

/// A struct that keys fill. Those of a table fill one or several.
using SceneOwner = std::variant<SceneFile*, StepOptions*, World*, SceneBody*, ShapeOptions*, Material*, SceneObstacle*,
                                HeatSource*, SceneMap*, ScenePair*, SceneFracture*, SceneCrack*, ScenePin*, SceneForce*,
                                SceneHand*, SceneFollow*, SceneFollowJoint*, SceneFollowContact*, ScenePicture*>;

/// Where the value of a key goes. Its type says what stands in the file: an enum a word, a Vec3f a colour.
using KeyPlace =
    std::variant<double*, unsigned*, unsigned long*, unsigned long long*, bool*, std::string*, StepMode*, FieldOf*,
                 MaterialModel*, FracturePatternKind*, View*, UpAxis*, Vec3d*, Keyed<double>*, Keyed<Vec3d>*,
                 std::vector<Vec3d>*, std::vector<Index>*, Eigen::AngleAxisd*, std::array<unsigned, 2>*,
                 std::array<double, 2>*, SceneBackground*, std::optional<double>*, std::optional<std::size_t>*,
                 std::optional<Index>*, std::optional<Vec3d>*, std::optional<Vec3f>*, std::optional<Box>*,
                 std::optional<Ball>*, std::optional<SceneRepeat>*>;

/// What a value may be; by default anything of its type.
struct KeyValues {
    double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
    bool above = false;          ///< `least` itself is not allowed
    std::string_view words = ""; ///< of a word, a space in between
    bool is_file = false;        ///< of a text: the name of a file, seen from the scene's folder
    /// A word of older versions. It counts as the first of `words`, and a warning says so.
    std::string_view former = "";
};

/// What a key belongs to; by default everything that its table may be.
struct KeyUse {
    std::string_view shapes = ""; ///< [[obstacle]]: shapes, a space in between; [[body]]: "shape" for built-in ones
    std::string_view models = ""; ///< [[body]]: models of a material
};

struct SceneKey {
    std::string_view table, name;
    KeyPlace (*place)(SceneOwner); ///< the member that it fills, in a struct that it is in
    SceneOwner (*fresh)();         ///< such a struct, filled by no file: its member is the default
    std::string_view unit;         ///< "" where there is none. An angle in degrees is a vector of radians in the struct
    KeyValues values;
    std::string_view text;
    std::string_view unset; ///< what holds without the key, where the fresh struct does not say it
    KeyUse use;

    bool is_in(SceneOwner owner) const { return owner.index() == fresh().index(); }
    KeyPlace fresh_place() const { return place(fresh()); }
};

/// In the order of the manual, table by table.
std::span<const SceneKey> scene_keys();
/// Null where there is none.
const SceneKey* find_key(std::string_view table, std::string_view name);
/// The keys of a material's numbers, and what one of them is in a material.
std::vector<const SceneKey*> material_numbers();
double& number_in(Material& material, const SceneKey& key);

/// "[[body]]" or "[world]".
std::string shown_table(std::string_view table);
bool is_list(std::string_view table); ///< one of those that may come several times

/// Calls visit(word) for each of some words with a space in between.
template <class Visit>
void each_word(std::string_view words, const Visit& visit) {
    for (std::size_t at = 0; at < words.size();) {
        const std::size_t end = std::min(words.find(' ', at), words.size());
        visit(words.substr(at, end - at));
        at = end + 1;
    }
}
bool has_word(std::string_view words, std::string_view word);

/// A sentence where the word is a former one of the key (KeyValues::former), without a full stop; "" where it is not.
std::string former_word_sentence(const SceneKey& key, std::string_view word);

/// What of a number is allowed, as words: "above 0", "0 to 1"; "" for anything.
std::string range_text(const KeyValues& values);
/// What holds without the key: "0.3".
std::string unset_text(const SceneKey& key);

/// The tables of docs/scenes.md: every key with its type, unit, default and range, and the materials by name.
std::string scene_manual();

/// Of `words` the one most like `word`, "" when none is like it.
std::string most_alike(std::string_view word, std::span<const std::string_view> words);

} // namespace filigree
