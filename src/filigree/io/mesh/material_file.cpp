// Wavefront MTL, as far as we keep it: Kd, map_Kd, d, Tr, and Pm and Pr, which many programs have added.
#include "filigree/io/mesh/material_file.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/text_scanner.h"
#include "filigree/io/system/text_writer.h"

#include <algorithm>
#include <cmath>
#include <map>
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
        bool defined = false, has_color = false, has_d = false;
    };

    /// Where a file's name leads, as seen from the mesh's folder; none when that is out of it. `beside`: the folder of
    /// the file that the name stands in.
    static std::optional<fs::path> inside(std::string_view name, const fs::path& beside) {
        std::string text(name);
        std::replace(text.begin(), text.end(), '\\', '/');
        const bool has_drive = text.size() > 1 && text[1] == ':';
        if (has_drive || text.starts_with('/') || text.find('\0') != std::string::npos) return std::nullopt;
        const fs::path path = (beside / path_of(text)).lexically_normal();
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
            std::optional<fs::path> path = inside(tried, beside);
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
            } else if (current && (keyword == "d" || keyword == "tr" || keyword == "pm" || keyword == "pr")) {
                read_number(*current, keyword, text.rest_of_line());
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

    /// Programs disagree on Tr: where d stands, d counts; and a material that Tr alone would hide is opaque.
    void read_number(std::size_t material, std::string_view keyword, std::string_view rest) {
        double value = 0;
        std::string_view text = rest, word = take_word(text);
        if (word == "-halo") word = take_word(text);
        if (!is_number(word, value) || !std::isfinite(value)) return;
        const auto number = static_cast<float>(std::clamp(value, 0.0, 1.0));
        MeshMaterial& result = materials_[material];
        if (keyword == "pm") result.metallic = number;
        if (keyword == "pr") result.roughness = number;
        if (keyword == "d") result.opacity = number, states_[material].has_d = true;
        if (keyword == "tr" && !states_[material].has_d) result.opacity = number < 1 ? 1 - number : 1;
    }

    void read_picture(std::size_t material, std::string_view rest, const fs::path& beside) {
        std::string_view name = rest;
        bool is_moved = false;
        while (skip_option(name, is_moved)) {
        }
        if (is_moved) moved_pictures_.add(materials_[material].name); // once, whatever moves it
        if (name.empty()) return missing_pictures_.add(rest);
        const std::optional<fs::path> path = find(name, beside, missing_pictures_);
        if (!path) return;
        MeshMaterial& result = materials_[material];
        result.picture = folder_ / *path;
    }

    /// Takes one option with its values off the front of `text`. A name may begin with '-' as well.
    static bool skip_option(std::string_view& text, bool& is_moved) {
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
            is_moved = is_moved || (moves && value != neutral && !(option == "-s" && i == 2));
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

// ---------------------------------------------------------------------------------------------------------- writing

constexpr std::string_view kOurMark = "# Filigree";

/// A name for files that every system and every reader of OBJ takes.
std::string as_file_name(std::string_view name) {
    constexpr std::size_t kLongest = 60;
    std::string plain(name.substr(0, kLongest));
    for (char& c : plain) {
        const bool is_ascii_word = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
        const bool is_other_script = static_cast<signed char>(c) < 0;
        if (!is_ascii_word && !is_other_script && c != '-' && c != '.') c = '_';
    }
    if (name.size() > kLongest) // not inside a character
        while (!plain.empty() && static_cast<signed char>(plain.back()) < 0) plain.pop_back();
    if (plain.empty() || plain.front() == '-' || plain.front() == '.') plain.insert(plain.begin(), '_');
    return plain;
}

class LibraryMaker {
public:
    LibraryMaker(const Mesh& mesh, const fs::path& obj_path)
        : mesh_(mesh), folder_(obj_path.parent_path()), stem_(as_file_name(obj_path.stem().string())) {}

    MaterialLibrary make() {
        library_.name = free_name(stem_, ".mtl", [&](const std::string& name) { return is_ours(name); });
        find_our_pictures();
        std::string text(kOurMark);
        text += ": the materials of an OBJ\n";
        {
            TextWriter out(text);
            const std::vector<std::string> names = obj_material_names(mesh_);
            for (std::size_t m = 0; m < names.size(); ++m) write(out, names[m], mesh_.embedded_materials[m]);
        }
        library_.files.push_back({library_.name, std::make_shared<const std::string>(std::move(text))});
        return std::move(library_);
    }

private:
    bool exists(const std::string& name) const {
        std::error_code ignored;
        return fs::exists(fs::symlink_status(folder_ / path_of(name), ignored));
    }

    bool is_ours(const std::string& name) const {
        std::error_code ignored;
        if (!fs::is_regular_file(folder_ / path_of(name), ignored)) return false;
        const Result<std::string> bytes = read_file(folder_ / path_of(name));
        return bytes && bytes->starts_with(kOurMark);
    }

    /// The name, with a number where another file has it.
    template <class MayReplace>
    std::string free_name(const std::string& stem, std::string_view extension, const MayReplace& may_replace) {
        std::string name = stem + std::string(extension);
        for (int number = 2; taken_.contains(name) || (exists(name) && !may_replace(name)); ++number)
            name = stem + "_" + std::to_string(number) + std::string(extension);
        taken_.insert(name);
        return name;
    }

    /// Those that the library names which is about to be replaced.
    void find_our_pictures() {
        if (!exists(library_.name)) return;
        const Result<std::string> bytes = read_file(folder_ / path_of(library_.name));
        if (!bytes) return;
        for (TextScanner text(*bytes); !text.at_end(); text.next_line())
            if (text.word() == "map_Kd") our_pictures_.insert(std::string(text.rest_of_line()));
    }

    void write(TextWriter& out, const std::string& name, const MeshMaterial& material) {
        out.text("\nnewmtl ").text(name).text("\nKd");
        for (const float c : material.color) out.text(" ").number(c);
        out.text("\nd ").number(material.opacity);
        out.text("\nPr ").number(material.roughness).text("\nPm ").number(material.metallic).text("\n");
        const bool is_black =
            material.color.maxCoeff() <= 0; // which readers, ours too, take for white beside a picture
        if (material.picture_bytes && !is_black)
            if (const std::string picture = picture_name(material, name); !picture.empty())
                out.text("map_Kd ").text(picture).text("\n");
    }

    std::string picture_name(const MeshMaterial& material, const std::string& name) {
        const auto [entry, is_new] = pictures_.try_emplace(material.picture_bytes.get());
        if (!is_new) return entry->second;
        const std::string_view extension = picture_extension(*material.picture_bytes);
        if (extension.empty()) {
            library_.warnings.push_back("The texture of the material " + in_quotes(name) +
                                        " is neither PNG nor JPEG and was left out.");
            return "";
        }
        entry->second = free_name(stem_ + "_" + as_file_name(name), extension,
                                  [&](const std::string& taken) { return our_pictures_.contains(taken); });
        library_.files.push_back({entry->second, material.picture_bytes});
        return entry->second;
    }

    const Mesh& mesh_;
    fs::path folder_;
    std::string stem_;
    MaterialLibrary library_;
    std::unordered_set<std::string> taken_, our_pictures_;
    std::map<const std::string*, std::string> pictures_;
};

} // namespace

MeshMaterials read_materials(const Mesh& mesh, const fs::path& mesh_path) {
    if (!mesh.embedded_materials.empty()) return {mesh.embedded_materials, {}};
    return MaterialReader(mesh, mesh_path).read();
}

MeshMaterials read_materials_and_pictures(const Mesh& mesh, const fs::path& mesh_path) {
    MeshMaterials found = read_materials(mesh, mesh_path);
    std::map<fs::path, std::shared_ptr<const std::string>> known;
    for (MeshMaterial& material : found.materials) {
        if (material.picture_bytes || material.picture.empty()) continue;
        const auto [picture, is_new] = known.try_emplace(material.picture, nullptr);
        if (is_new) {
            if (Result<std::string> bytes = read_file(material.picture))
                picture->second = std::make_shared<const std::string>(std::move(*bytes));
            else
                found.warnings.push_back(bytes.error().message);
        }
        material.picture_bytes = picture->second;
        material.picture.clear();
    }
    return found;
}

std::vector<std::string> obj_material_names(const Mesh& mesh) {
    std::vector<std::string> names;
    std::unordered_set<std::string> taken;
    for (const std::string& given : mesh.materials.names) {
        std::string line;
        TextWriter(line).name(given);
        const std::string name = trimmed(line).empty() ? "material" : std::string(trimmed(line));
        std::string free_name = name;
        for (int number = 2; !taken.insert(free_name).second; ++number) free_name = name + "_" + std::to_string(number);
        names.push_back(free_name);
    }
    return names;
}

MaterialLibrary make_material_library(const Mesh& mesh, const fs::path& obj_path) {
    return LibraryMaker(mesh, obj_path).make();
}

std::string_view picture_extension(std::string_view bytes) {
    if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return ".png";
    return bytes.starts_with("\xff\xd8\xff") ? ".jpg" : "";
}

} // namespace filigree
