#include "filigree/file.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/mesh/material_file.h"
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"

#include <algorithm>
#include <array>
#include <new>
#include <stdexcept>

namespace filigree {

namespace {

/// A format. To add one: its reader and writer in a file of their own, MeshFormat, and a row below.
struct FormatRow {
    MeshFormatInfo info;
    bool (*is_content)(std::string_view bytes);
    bool is_content_certain; ///< else the extension of the name decides first
    Result<MeshFile> (*read)(const MeshSource& source);
    Result<WriteNotes> (*write)(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                                const RunContext& context);
};

constexpr std::array kFormats = {
    FormatRow{{MeshFormat::obj, "OBJ", ".obj", ""}, is_obj, false, read_obj, write_obj},
    FormatRow{{MeshFormat::ply, "PLY", ".ply", ""}, is_ply, true, read_ply, write_ply},
    FormatRow{{MeshFormat::stl, "STL", ".stl", ""}, is_stl, true, read_stl, write_stl},
    FormatRow{{MeshFormat::off, "OFF", ".off", ""}, is_off, true, read_off, write_off},
    FormatRow{{MeshFormat::gltf, "GLB", ".glb", ".gltf"}, is_gltf, true, read_gltf, write_glb},
};

constexpr std::array kInfos = [] {
    std::array<MeshFormatInfo, kFormats.size()> infos{};
    std::ranges::transform(kFormats, infos.begin(), &FormatRow::info);
    return infos;
}();

const FormatRow& row_of(MeshFormat format) {
    return *std::ranges::find(kFormats, format, [](const FormatRow& row) { return row.info.format; });
}

/// "use .obj, .ply, .stl, .off or .glb"
std::string known_formats() {
    std::string sentence = "use ";
    for (std::size_t i = 0; i < kInfos.size(); ++i) {
        if (i > 0) sentence += i + 1 < kInfos.size() ? ", " : " or ";
        sentence += kInfos[i].extension;
    }
    return sentence;
}

/// Content that is recognised, and what to say about it.
struct Foreign {
    std::string_view start;
    ErrorCode code;
    std::string_view what;
};

constexpr std::array kForeign = {
    Foreign{"\x1f\x8b", ErrorCode::unsupported, "is compressed with gzip; unpack it first"},
    Foreign{"PK\x03\x04", ErrorCode::unsupported, "is a zip archive; unpack it first"},
    Foreign{"BZh", ErrorCode::unsupported, "is compressed with bzip2; unpack it first"},
    Foreign{"\xfd"
            "7zXZ",
            ErrorCode::unsupported, "is compressed with xz; unpack it first"},
    Foreign{"\x28\xb5\x2f\xfd", ErrorCode::unsupported, "is compressed with zstd; unpack it first"},
    Foreign{"\x89PNG", ErrorCode::bad_file, "is a PNG picture, not a mesh"},
    Foreign{"\xff\xd8\xff", ErrorCode::bad_file, "is a JPEG picture, not a mesh"},
    Foreign{"Kaydara FBX", ErrorCode::unsupported, "is FBX, which is not read; export it as OBJ or PLY"},
    Foreign{"<", ErrorCode::unsupported, "holds XML or a web page, which is not read; export it as OBJ or PLY"},
    Foreign{"version https://git-lfs", ErrorCode::bad_file,
            "is only a Git LFS pointer; fetch the real file with 'git lfs pull'"},
    Foreign{"\xff\xfe", ErrorCode::bad_file, "is text in UTF-16; save it as UTF-8"},
    Foreign{"\xfe\xff", ErrorCode::bad_file, "is text in UTF-16; save it as UTF-8"},
};

const Foreign* find_foreign(std::string_view bytes) {
    static constexpr Foreign kWideText{"", ErrorCode::bad_file, "is text in UTF-16; save it as UTF-8"};
    const auto* found =
        std::find_if(kForeign.begin(), kForeign.end(), [&](const Foreign& f) { return bytes.starts_with(f.start); });
    if (found != kForeign.end()) return found;
    const auto is_text = [](char c) { return (c >= ' ' && c <= '~') || c == '\n' || c == '\r' || c == '\t'; };
    const bool wide = bytes.size() >= 4 && ((is_text(bytes[0]) && !bytes[1] && is_text(bytes[2]) && !bytes[3]) ||
                                            (!bytes[0] && is_text(bytes[1]) && !bytes[2] && is_text(bytes[3])));
    return wide ? &kWideText : nullptr;
}

std::optional<MeshFormat> format_of_content(std::string_view bytes, bool is_certain) {
    const auto found = std::ranges::find_if(
        kFormats, [&](const FormatRow& row) { return row.is_content_certain == is_certain && row.is_content(bytes); });
    if (found == kFormats.end()) return std::nullopt;
    return found->info.format;
}

Result<MeshFormat> decide_format(std::string_view bytes, const std::string& name) {
    if (const auto format = format_of_content(bytes, true)) return *format;
    Result<MeshFormat> by_name = mesh_format(path_of(name));
    if (by_name.ok()) return by_name;
    if (const auto format = format_of_content(bytes, false)) return *format;
    return Error{ErrorCode::unsupported, name +
                                             ": neither its content nor its extension is of a mesh format we read; " +
                                             known_formats() + "."};
}

void mend_attributes(MeshFile& file) {
    const auto warn = [&](std::size_t mended, const std::string& what) {
        if (mended > 0)
            file.warnings.push_back(std::to_string(mended) + " " + what + " were not finite and became zero.");
    };
    warn(zero_not_finite(file.mesh.uvs.values), "UVs");
    warn(zero_not_finite(file.mesh.normals.values), "normals");
    warn(zero_not_finite(file.mesh.colors), "colours");
    for (VertexScalar& scalar : file.mesh.scalars)
        warn(zero_not_finite(scalar.values), "values of the scalar '" + scalar.name + "'");
}

/// Names are without zero bytes, which end a name in other programs and in our own models.
void mend_names(MeshFile& file) {
    std::size_t mended = 0;
    const auto mend_name = [&](std::string& name) {
        if (name.find('\0') == std::string::npos) return;
        std::replace(name.begin(), name.end(), '\0', '_');
        ++mended;
    };
    Mesh& mesh = file.mesh;
    for (VertexScalar& scalar : mesh.scalars) mend_name(scalar.name);
    for (FaceLabels* labels : {&mesh.objects, &mesh.groups, &mesh.materials})
        for (std::string& name : labels->names) mend_name(name);
    for (MeshMaterial& material : mesh.embedded_materials) mend_name(material.name);
    for (std::string& name : mesh.material_files) mend_name(name);
    if (mended > 0)
        file.warnings.push_back(std::to_string(mended) + (mended == 1 ? " name has" : " names have") +
                                " a zero byte inside, which became '_'.");
}

/// Colours from 0 to 255 as numbers, which some programs write, become 0 to 1.
void scale_colors(MeshFile& file) {
    std::vector<Vec4f>& colors = file.mesh.colors;
    const bool bytes =
        std::any_of(colors.begin(), colors.end(), [](const Vec4f& c) { return c.head<3>().maxCoeff() > 1; });
    if (!bytes) return;
    const bool alpha = std::any_of(colors.begin(), colors.end(), [](const Vec4f& c) { return c.w() > 1; });
    for (Vec4f& c : colors) c.head(alpha ? 4 : 3) /= 255.0f;
    file.warnings.emplace_back("Colours go beyond 1 and were taken as 0 to 255.");
}

Result<MeshFile> read_checked(std::string_view bytes, const std::string& name, const RunContext& context) {
    const MeshSource source{bytes, name, context};
    if (context.is_cancelled()) return cancelled_error();
    if (bytes.empty()) return source.error("is empty.");
    if (const Foreign* foreign = find_foreign(bytes))
        return Error{foreign->code, name + ": " + std::string(foreign->what) + "."};
    const std::string_view byte_order_mark = "\xef\xbb\xbf";
    const std::string_view text = bytes.starts_with(byte_order_mark) ? bytes.substr(byte_order_mark.size()) : bytes;
    const Result<MeshFormat> format = decide_format(text, name);
    if (!format.ok()) return format.error();
    Result<MeshFile> file = row_of(*format).read({text, name, context});
    if (!file.ok()) return file;
    if (file->mesh.positions.empty())
        return source.error("has no vertices." + (file->warnings.empty() ? "" : " " + file->warnings.front()));
    if (file->mesh.face_count() == 0)
        file->warnings.push_back("There are no faces: read as " + std::to_string(file->mesh.vertex_count()) +
                                 (file->mesh.vertex_count() == 1 ? " point." : " points."));
    mend_names(*file);
    mend_attributes(*file);
    scale_colors(*file);
    assert(check_mesh(file->mesh).empty());
    context.report("Reading", 1);
    return file;
}

Error out_of_memory(const std::string& name) {
    return {ErrorCode::out_of_memory, name + ": does not fit into memory."};
}

std::vector<std::string> sentences(std::string_view format, WriteNotes notes) {
    if (!notes.lost.empty())
        notes.warnings.insert(notes.warnings.begin(), cannot_hold(std::string(format), notes.lost));
    return std::move(notes.warnings);
}

/// An OBJ with its embedded materials beside it: pictures first, the mesh last, each whole or not at all.
Result<std::vector<std::string>> write_obj_with_materials(const Mesh& mesh, const std::filesystem::path& path) {
    MaterialLibrary library;
    std::string bytes;
    std::vector<std::string> lost;
    try {
        library = make_material_library(mesh, path);
        lost = write_obj(mesh, library.name, bytes);
    } catch (const std::bad_alloc&) {
        return out_of_memory("OBJ");
    }
    library.files.push_back({path.filename().string(), std::make_shared<const std::string>(std::move(bytes))});
    for (const MaterialLibrary::File& file : library.files) {
        if (const Status written = write_file(path.parent_path() / path_of(file.name), *file.bytes); !written)
            return written.error();
    }
    return sentences("OBJ", {std::move(lost), std::move(library.warnings)});
}

/// Whether other files can lie beside it: no pipe or device.
bool is_file_in_folder(const std::filesystem::path& path) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    return path != "-" && (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status));
}

} // namespace

std::span<const MeshFormatInfo> mesh_formats() { return kInfos; }

Result<MeshFormat> mesh_format(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    const auto found = std::ranges::find_if(kInfos, [&](const MeshFormatInfo& info) {
        return !extension.empty() && (extension == info.extension || extension == info.other_extension);
    });
    if (found != kInfos.end()) return found->format;
    return Error{ErrorCode::unsupported, path.string() + ": " +
                                             (extension.empty() ? "a name without an extension" : extension) +
                                             " is not of a mesh format we know; " + known_formats() + "."};
}

Result<MeshFile> read_mesh(std::string_view bytes, const std::string& name, const RunContext& context) {
    try {
        return read_checked(bytes, name, context);
    } catch (const std::bad_alloc&) {
        return out_of_memory(name);
    } catch (const std::length_error&) {
        return out_of_memory(name);
    }
}

Result<MeshFile> read_mesh(const std::filesystem::path& path, const RunContext& context) {
    const Result<std::string> bytes = read_file(path);
    if (!bytes.ok()) return bytes.error();
    return read_mesh(*bytes, path == "-" ? "standard input" : path.string(), context);
}

Result<std::vector<std::string>> write_mesh(const Mesh& mesh, MeshFormat format, std::string& bytes,
                                            const WriteMeshOptions& options, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    bytes.clear();
    const FormatRow& row = row_of(format);
    try {
        Result<WriteNotes> notes = row.write(mesh, options, bytes, context);
        if (!notes) return notes.error();
        return sentences(row.info.name, *std::move(notes));
    } catch (const std::bad_alloc&) {
        return out_of_memory(std::string(row.info.name));
    } catch (const std::length_error&) {
        return out_of_memory(std::string(row.info.name));
    }
}

Result<std::vector<std::string>> write_mesh(const Mesh& mesh, const std::filesystem::path& path,
                                            const WriteMeshOptions& options, const RunContext& context) {
    if (const std::string wrong = check_mesh(mesh); !wrong.empty())
        return Error{ErrorCode::unsuitable, path.string() +
                                                ": not written: the result is beyond what numbers can hold (" + wrong +
                                                "); deform less."};
    const Result<MeshFormat> format = options.format ? Result<MeshFormat>(*options.format) : mesh_format(path);
    if (!format.ok()) return format.error();
    if (const MeshFormatInfo& info = row_of(*format).info;
        !info.other_extension.empty() && lower_extension(path) == info.other_extension)
        return Error{ErrorCode::unsupported,
                     path.string() + ": is read but not written; write " + std::string(info.extension) + "."};
    if (context.is_cancelled()) return cancelled_error();
    if (*format == MeshFormat::obj && !mesh.embedded_materials.empty() && is_file_in_folder(path))
        return write_obj_with_materials(mesh, path);
    std::string bytes;
    Result<std::vector<std::string>> warnings = write_mesh(mesh, *format, bytes, options, context);
    if (!warnings.ok()) return warnings;
    if (context.is_cancelled()) return cancelled_error();
    if (const Status written = write_file(path, bytes); !written) return written.error();
    return warnings;
}

} // namespace filigree
