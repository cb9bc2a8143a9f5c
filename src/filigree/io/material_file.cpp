// Wavefront MTL, as far as we draw it: Kd and map_Kd.
#include "filigree/io/material_file.h"
#include "filigree/io/file.h"
#include "filigree/io/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <unordered_set>

namespace filigree {

namespace {

namespace fs = std::filesystem;

bool is_blank(char c) { return TextScanner::is_blank(c); }

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

/// The first word, taken off `text`. Unlike the scanner's, it may hold '#' and backslashes, as file names do.
std::string_view take_word(std::string_view& text) {
    text = trimmed(text);
    const auto length = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_blank) - text.begin());
    const std::string_view word = text.substr(0, length);
    text = trimmed(text.substr(length));
    return word;
}

std::string_view without_quotes(std::string_view name) {
    const bool quoted = name.size() > 1 && name.front() == '"' && name.back() == '"';
    return quoted ? name.substr(1, name.size() - 2) : name;
}

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return lower;
}

bool is_number(std::string_view word, double& value) {
    return !word.empty() && parse_number(word.data(), word.data() + word.size(), value) == word.data() + word.size();
}

/// One kind of trouble: the first is named, the others are counted.
class Trouble {
public:
    void add(std::string_view name) {
        if (count_++ == 0) first_ = name;
    }
    void report(const std::string& before, const std::string& after, std::vector<std::string>& warnings) const {
        if (count_ == 0) return;
        const std::string more = count_ > 1 ? " (and " + std::to_string(count_ - 1) + " more)" : "";
        warnings.push_back(before + " " + in_quotes(first_) + more + " " + after);
    }

private:
    std::size_t count_ = 0;
    std::string first_;
};

class MaterialReader {
public:
    MaterialReader(const Mesh& mesh, const fs::path& mesh_path) : mesh_(mesh), folder_(mesh_path.parent_path()) {
        for (const std::string& name : mesh.materials.names) {
            wanted_.try_emplace(name, materials_.size());
            materials_.emplace_back().name = name;
        }
        states_.resize(materials_.size());
    }

    MeshMaterials read() {
        if (materials_.empty()) return {};
        for (const std::string& line : mesh_.material_files) read_libraries(line);
        for (std::size_t m = 0; m < materials_.size(); ++m)
            if (!states_[m].defined) unknown_materials_.add(materials_[m].name);
        report();
        return {std::move(materials_), std::move(warnings_)};
    }

private:
    struct State {
        bool defined = false, has_color = false;
    };

    /// Where a file's name leads, as seen from the mesh's folder; none when that is out of it. `beside`: the folder of
    /// the file that the name stands in.
    static std::optional<fs::path> inside(std::string_view name, const fs::path& beside) {
        std::string text(name);
        std::replace(text.begin(), text.end(), '\\', '/');
        const bool has_drive = text.size() > 1 && text[1] == ':';
        if (has_drive || text.starts_with('/') || text.find('\0') != std::string::npos) return std::nullopt;
        const fs::path path = (beside / text).lexically_normal();
        if (!path.empty() && *path.begin() == "..") return std::nullopt;
        return path;
    }

    bool is_file(const fs::path& path) const { // not a pipe, which we could wait for forever
        std::error_code ignored;
        return fs::is_regular_file(folder_ / path, ignored);
    }

    /// The file of that name; tells what keeps it from being found. A name may hold a '#', so a comment is only thought
    /// of when there is no such file.
    std::optional<fs::path> find(std::string_view name, const fs::path& beside, Trouble& missing) {
        const std::string_view bare = trimmed(name.substr(0, std::min(name.find(" #"), name.find("\t#"))));
        for (const std::string_view tried : {without_quotes(name), without_quotes(bare)}) {
            const std::optional<fs::path> path = inside(tried, beside);
            if (path && is_file(*path)) return path;
        }
        (inside(without_quotes(bare), beside) ? missing : outside_).add(bare);
        return std::nullopt;
    }

    /// A line may hold one name with blanks, or several names.
    void read_libraries(const std::string& line) {
        const std::optional<fs::path> whole = inside(without_quotes(line), {});
        if (whole && is_file(*whole)) return read_library(*whole);
        std::string_view rest = line;
        std::vector<std::string_view> names;
        while (!rest.empty()) names.push_back(take_word(rest));
        const bool several = std::any_of(names.begin(), names.end(), [&](std::string_view name) {
            const std::optional<fs::path> path = inside(name, {});
            return path && is_file(*path);
        });
        if (!several) names = {line};
        for (const std::string_view name : names)
            if (const auto path = find(name, {}, missing_libraries_)) read_library(*path);
    }

    void read_library(const fs::path& path) {
        if (!libraries_read_.insert(path.string()).second) return;
        const Result<std::string> bytes = read_file(folder_ / path);
        if (!bytes) return unreadable_libraries_.add(path.string());
        std::optional<std::size_t> current; // none: a material that the mesh does not use, or has already
        for (TextScanner text(*bytes); !text.at_end(); text.next_line()) {
            text.skip_blanks();
            const std::string keyword = lower_case(text.word());
            if (keyword == "newmtl") {
                current = begin_material(text.rest_of_line());
            } else if (current && keyword == "kd") {
                read_color(*current, text.rest_of_line());
            } else if (current && keyword == "map_kd") {
                read_picture(*current, text.rest_of_line(), path.parent_path());
            }
        }
    }

    std::optional<std::size_t> begin_material(std::string_view name) {
        const auto entry = wanted_.find(std::string(name));
        if (entry == wanted_.end() || states_[entry->second].defined) return std::nullopt;
        states_[entry->second].defined = true;
        return entry->second;
    }

    /// One number is a grey.
    void read_color(std::size_t material, std::string_view rest) {
        TextScanner text(rest);
        double numbers[3] = {};
        int count = 0;
        for (text.skip_blanks(); count < 3 && text.number(numbers[count]); text.skip_blanks()) {
            if (!std::isfinite(numbers[count])) break;
            ++count;
        }
        if ((count != 1 && count != 3) || !text.at_line_end()) return odd_colors_.add(materials_[material].name);
        for (int i = 0; i < 3; ++i)
            materials_[material].color[i] = static_cast<float>(std::clamp(numbers[count == 3 ? i : 0], 0.0, 1.0));
        states_[material].has_color = true;
    }

    void read_picture(std::size_t material, std::string_view rest, const fs::path& beside) {
        std::string_view name = rest;
        while (skip_option(material, name)) {
        }
        if (name.empty()) return missing_pictures_.add(rest);
        const std::optional<fs::path> path = find(name, beside, missing_pictures_);
        if (!path) return;
        MeshMaterial& result = materials_[material];
        result.picture = folder_ / *path;
    }

    /// Takes one option with its values off the front of `text`. A name may begin with '-' as well.
    bool skip_option(std::size_t material, std::string_view& text) {
        std::string_view rest = text;
        const std::string option = lower_case(take_word(rest));
        const bool moves = option == "-o" || option == "-s" || option == "-t";
        const bool one_word = option == "-blendu" || option == "-blendv" || option == "-cc" || option == "-clamp" ||
                              option == "-texres" || option == "-bm" || option == "-boost" || option == "-imfchan" ||
                              option == "-type";
        if (!moves && !one_word && option != "-mm") return false;
        if (one_word) take_word(rest);
        const int most_numbers = moves ? 3 : option == "-mm" ? 2 : 0;
        const double neutral = option == "-s" ? 1 : 0;
        for (int i = 0; i < most_numbers; ++i) {
            std::string_view behind = rest;
            double value = 0;
            if (!is_number(take_word(behind), value) || behind.empty()) break; // the last word is the name
            if (moves && value != neutral && !(option == "-s" && i == 2))
                moved_pictures_.add(materials_[material].name);
            rest = behind;
        }
        text = rest;
        return true;
    }

    /// What programs leave out or write beside a picture, which our colour would darken.
    void brighten_pictures() {
        for (std::size_t m = 0; m < materials_.size(); ++m) {
            MeshMaterial& material = materials_[m];
            const bool black = material.color.maxCoeff() <= 0;
            if (!material.picture.empty() && (black || !states_[m].has_color)) material.color = Vec3f::Ones();
        }
    }

    void report() {
        brighten_pictures();
        missing_libraries_.report("The material library", "was not found beside the mesh.", warnings_);
        unreadable_libraries_.report("The material library", "cannot be read.", warnings_);
        unknown_materials_.report("The material", "is in no material library; it became grey.", warnings_);
        odd_colors_.report("The colour (Kd) of the material", "is not three numbers; it was left out.", warnings_);
        missing_pictures_.report("The texture", "was not found beside the mesh.", warnings_);
        moved_pictures_.report("The texture of the material", "is drawn without its scale and offset (-s, -o, -t).",
                               warnings_);
        outside_.report("The file", "is named outside of the mesh's folder and was not read; copy it beside the mesh.",
                        warnings_);
    }

    const Mesh& mesh_;
    fs::path folder_;
    std::vector<MeshMaterial> materials_;
    std::vector<State> states_;
    std::unordered_map<std::string, std::size_t> wanted_;
    std::unordered_set<std::string> libraries_read_;
    std::vector<std::string> warnings_;
    Trouble missing_libraries_, unreadable_libraries_, unknown_materials_, odd_colors_, missing_pictures_,
        moved_pictures_, outside_;
};

} // namespace

MeshMaterials read_materials(const Mesh& mesh, const fs::path& mesh_path) {
    return MaterialReader(mesh, mesh_path).read();
}

} // namespace filigree
