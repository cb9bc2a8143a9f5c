#include "filigree/io/usd.h"
#include "filigree/core/srgb.h"
#include "filigree/io/file.h"
#include "filigree/io/mesh_formats.h"
#include "filigree/io/text_writer.h"
#include "filigree/mesh/normals.h"

namespace filigree {

namespace {

constexpr std::size_t kLargeText = 200'000'000; // bytes; above, programs take minutes to open it

/// Text on its way into a file, in pieces.
class UsdText {
public:
    explicit UsdText(FileWriter& file) : file_(file) {}

    UsdText& text(std::string_view s) {
        writer_.text(s);
        return *this;
    }
    template <class T>
    UsdText& number(T x) {
        writer_.number(x);
        return *this;
    }
    /// "[(1, 2), (3, 4)]" of vectors, "[1, 2]" of numbers.
    template <class Items>
    UsdText& list(const Items& items) {
        text("[");
        bool is_first = true;
        for (const auto& item : items) {
            if (!std::exchange(is_first, false)) text(", ");
            this->item(item);
            drain(kPiece);
        }
        return text("]");
    }
    /// "12: [...]," and a line end.
    template <class Items>
    UsdText& sample(std::size_t frame, const Items& items) {
        return text("        ").number(frame).text(": ").list(items).text(",\n");
    }
    /// Writes what was made. Errors of any piece come out here.
    Status finish() {
        drain(0);
        return written_;
    }

private:
    static constexpr std::size_t kPiece = std::size_t{1} << 20;

    template <class T>
    void item(const T& value) {
        if constexpr (std::is_arithmetic_v<T>) {
            number(value);
        } else {
            for (int i = 0; i < int(T::RowsAtCompileTime); ++i) text(i == 0 ? "(" : ", ").number(value[i]);
            text(")");
        }
    }
    void drain(std::size_t until) {
        if (until == 0) writer_.flush();
        if (bytes_.size() <= until) return;
        if (written_) written_ = file_.write(bytes_);
        bytes_.clear();
    }

    FileWriter& file_;
    std::string bytes_;
    TextWriter writer_{bytes_};
    Status written_ = Success{};
};

void write_header(UsdText& out, const MeshAnimation& animation) {
    out.text("#usda 1.0\n(\n    defaultPrim = \"mesh\"\n    doc = \"Written by Filigree\"\n    endTimeCode = ")
        .number(animation.frames - 1)
        .text("\n    framesPerSecond = ")
        .number(animation.frames_per_second)
        .text("\n    startTimeCode = 0\n    timeCodesPerSecond = ")
        .number(animation.frames_per_second)
        .text("\n    upAxis = \"Y\"\n)\n\ndef Mesh \"mesh\"\n{\n");
}

void write_faces(UsdText& out, const Mesh& mesh) {
    std::vector<Index> sizes(mesh.face_count());
    for (std::size_t f = 0; f < sizes.size(); ++f) sizes[f] = mesh.face_size(f);
    out.text("    int[] faceVertexCounts = ").list(sizes);
    out.text("\n    int[] faceVertexIndices = ").list(mesh.corners);
    out.text("\n    uniform token subdivisionScheme = \"none\"\n");
}

void write_uvs(UsdText& out, const Mesh& mesh) {
    if (mesh.uvs.empty()) return;
    std::vector<Vec2f> values = mesh.uvs.values;
    std::vector<Index> corners = mesh.uvs.corners;
    for (Index& corner : corners) {
        if (corner != kNoIndex) continue;
        if (values.size() == mesh.uvs.values.size())
            values.emplace_back(Vec2f::Zero()); // corners without a UV share it
        corner = static_cast<Index>(values.size() - 1);
    }
    out.text("    texCoord2f[] primvars:st = ").list(values).text(" (\n        interpolation = \"");
    out.text(corners.empty() ? "vertex" : "faceVarying").text("\"\n    )\n");
    if (!corners.empty()) out.text("    int[] primvars:st:indices = ").list(corners).text("\n");
}

void write_colors(UsdText& out, const Mesh& mesh) {
    if (mesh.colors.empty()) return;
    std::vector<Vec3f> colors;
    std::vector<float> opacities;
    const auto linear = [](float channel) { return static_cast<float>(linear_from_srgb(channel)); };
    for (const Vec4f& color : mesh.colors) {
        colors.emplace_back(linear(color.x()), linear(color.y()), linear(color.z()));
        opacities.push_back(color.w());
    }
    constexpr std::string_view kVertex = " (\n        interpolation = \"vertex\"\n    )\n";
    out.text("    color3f[] primvars:displayColor = ").list(colors).text(kVertex);
    if (mesh.colors_have_alpha) out.text("    float[] primvars:displayOpacity = ").list(opacities).text(kVertex);
}

std::vector<std::string> losses(const Mesh& mesh) {
    std::vector<std::string> lost;
    if (!mesh.objects.empty()) lost.emplace_back("objects");
    add_face_label_losses(mesh, lost);
    add_scalar_losses(mesh, lost);
    return lost;
}

void add_warnings(const MeshAnimation& animation, std::vector<std::string>& warnings) {
    constexpr std::size_t kVectorText = 30; // bytes, as measured
    const Mesh& mesh = *animation.rest;
    if (const std::vector<std::string> lost = losses(mesh); !lost.empty())
        warnings.push_back(cannot_hold("USD text", lost));
    const std::size_t bytes = animation.frames * mesh.vertex_count() * kVectorText * (mesh.normals.empty() ? 1 : 2);
    if (bytes > kLargeText)
        warnings.push_back("The USD text is about " + std::to_string(bytes / 1'000'000) +
                           " MB, which programs open slowly; a point cache (.pc2) is a third of it.");
}

/// What moves: points with their boxes, and normals where the mesh has some.
class TimeSamples {
public:
    TimeSamples(const MeshAnimation& animation, const WorldPositions& positions, UsdText& out,
                const RunContext& context)
        : animation_(animation), positions_(positions), out_(out), context_(context),
          has_normals_(!animation.rest->normals.empty()), points_(animation.rest->vertex_count()) {}

    Status write() {
        if (Status moved = write_points(); !moved) return moved;
        return has_normals_ ? write_normals() : Status(Success{});
    }

private:
    const MeshAnimation& animation_;
    const WorldPositions& positions_;
    UsdText& out_;
    const RunContext& context_;
    bool has_normals_;
    std::vector<Vec3f> points_; ///< of the frame at hand

    /// done: the fraction before the first.
    template <class Write>
    Status each_frame(double done, const Write& write) {
        for (std::size_t frame = 0; frame < animation_.frames; ++frame) {
            context_.report("writing", done + double(frame) / double(animation_.frames) / (has_normals_ ? 2 : 1));
            if (context_.is_cancelled()) return cancelled_error();
            if (Status fetched = positions_(frame, points_); !fetched) return fetched;
            write(frame);
            if (Status written = out_.finish(); !written) return written;
        }
        return Success{};
    }

    Status write_points() {
        std::vector<Box> boxes;
        out_.text("    point3f[] points.timeSamples = {\n");
        const Status moved = each_frame(0, [&](std::size_t frame) {
            out_.sample(frame, points_);
            boxes.push_back(bounds(points_));
        });
        if (!moved) return moved;
        out_.text("    }\n    float3[] extent.timeSamples = {\n");
        for (std::size_t frame = 0; frame < boxes.size(); ++frame)
            out_.sample(frame, std::array<Vec3f, 2>{boxes[frame].min.cast<float>(), boxes[frame].max.cast<float>()});
        out_.text("    }\n");
        return Success{};
    }

    Status write_normals() {
        out_.text("    normal3f[] normals (\n        interpolation = \"vertex\"\n    )\n"
                  "    normal3f[] normals.timeSamples = {\n");
        const Status turned = each_frame(
            0.5, [&](std::size_t frame) { out_.sample(frame, vertex_normals(*animation_.rest, points_, context_)); });
        if (turned) out_.text("    }\n");
        return turned;
    }
};

} // namespace

Status write_usda(const MeshAnimation& animation, const WorldPositions& positions, const std::filesystem::path& path,
                  std::vector<std::string>& warnings, const RunContext& context) {
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    UsdText out(*file);
    write_header(out, animation);
    write_faces(out, *animation.rest);
    write_uvs(out, *animation.rest);
    write_colors(out, *animation.rest);
    if (Status moved = TimeSamples(animation, positions, out, context).write(); !moved) return moved;
    out.text("}\n");
    if (Status written = out.finish(); !written) return written;
    if (context.is_cancelled()) return cancelled_error();
    context.report("writing", 1);
    add_warnings(animation, warnings);
    return file->finish();
}

} // namespace filigree
