#include "filigree/io/animation/usd.h"
#include "filigree/core/srgb.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/platform.h"
#include "filigree/io/system/text_writer.h"
#include "filigree/mesh/normals.h"

#include <memory>

namespace filigree {

namespace {

constexpr std::size_t kLargeText = 200'000'000; // bytes; above, programs take minutes to open it

/// Text on its way into a file, in pieces.
class UsdText {
public:
    using Sink = std::function<Status(std::string_view bytes)>;
    explicit UsdText(Sink sink) : sink_(std::move(sink)) {}
    explicit UsdText(FileWriter& file) : UsdText([&file](std::string_view bytes) { return file.write(bytes); }) {}

    UsdText& text(std::string_view s) {
        writer_.text(s);
        return *this;
    }
    template <class T>
    UsdText& number(T x) {
        writer_.number(x);
        return *this;
    }
    /// "(1, 2)".
    template <class Vector>
    UsdText& vector(const Vector& v) {
        for (int i = 0; i < int(Vector::RowsAtCompileTime); ++i) text(i == 0 ? "(" : ", ").number(v[i]);
        return text(")");
    }
    /// "[(1, 2), (3, 4)]" of vectors, "[1, 2]" of numbers.
    template <class Items>
    UsdText& list(const Items& items) {
        text("[");
        bool is_first = true;
        for (const auto& item : items) {
            if (!std::exchange(is_first, false)) text(", ");
            if constexpr (std::is_arithmetic_v<std::decay_t<decltype(item)>>)
                number(item);
            else
                vector(item);
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

    void drain(std::size_t until) {
        if (until == 0) writer_.flush();
        if (bytes_.size() <= until) return;
        if (written_) written_ = sink_(bytes_);
        bytes_.clear();
    }

    Sink sink_;
    std::string bytes_;
    TextWriter writer_{bytes_};
    Status written_ = Success{};
};

/// origin: of the points that follow, in the world. Numbers of 64 bits, where points have 32.
/// metres_per_unit: 0 is not said.
void write_header(UsdText& out, std::size_t frames, double frames_per_second, const Vec3d& origin,
                  double metres_per_unit) {
    out.text("#usda 1.0\n(\n    defaultPrim = \"mesh\"\n    doc = \"Written by Filigree\"\n    endTimeCode = ")
        .number(frames - 1)
        .text("\n    framesPerSecond = ")
        .number(frames_per_second);
    if (metres_per_unit > 0) out.text("\n    metersPerUnit = ").number(metres_per_unit);
    out.text("\n    startTimeCode = 0\n    timeCodesPerSecond = ")
        .number(frames_per_second)
        .text("\n    upAxis = \"Y\"\n)\n\ndef Mesh \"mesh\"\n{\n");
    if (origin.isZero(0)) return;
    out.text("    double3 xformOp:translate = ").vector(origin);
    out.text("\n    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n");
}

std::vector<Index> face_sizes(const Mesh& mesh) {
    std::vector<Index> sizes(mesh.face_count());
    for (std::size_t f = 0; f < sizes.size(); ++f) sizes[f] = mesh.face_size(f);
    return sizes;
}

void write_faces(UsdText& out, const Mesh& mesh) {
    out.text("    int[] faceVertexCounts = ").list(face_sizes(mesh));
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

std::vector<Vec3f> display_colors(const Mesh& mesh) {
    std::vector<Vec3f> colors;
    const auto linear = [](float channel) { return static_cast<float>(linear_from_srgb(channel)); };
    for (const Vec4f& color : mesh.colors) colors.emplace_back(linear(color.x()), linear(color.y()), linear(color.z()));
    return colors;
}

constexpr std::string_view kVertex = " (\n        interpolation = \"vertex\"\n    )\n";

void write_colors(UsdText& out, const Mesh& mesh) {
    if (mesh.colors.empty()) return;
    std::vector<float> opacities;
    for (const Vec4f& color : mesh.colors) opacities.push_back(color.w());
    out.text("    color3f[] primvars:displayColor = ").list(display_colors(mesh)).text(kVertex);
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
    TimeSamples(const MeshAnimation& animation, UsdText& out, const RunContext& context)
        : animation_(animation), out_(out), context_(context), has_normals_(!animation.rest->normals.empty()),
          points_(animation.rest->vertex_count()) {}

    Status write() {
        if (Status moved = write_points(); !moved) return moved;
        return has_normals_ ? write_normals() : Status(Success{});
    }

private:
    const MeshAnimation& animation_;
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
            if (Status fetched = animation_.positions(frame, points_); !fetched) return fetched;
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

/// Text that is made frame by frame and belongs behind other text: in a file that nobody else sees.
class WaitingText {
public:
    explicit WaitingText(const std::filesystem::path& folder) : file_(platform::open_scratch(folder)) {}

    UsdText text{[this](std::string_view bytes) -> Status {
        if (!file_.is_open() || platform::write_at(file_.get(), size_, bytes) != 0) return failure();
        size_ += bytes.size();
        return Success{};
    }};

    Status append_to(FileWriter& out) {
        if (Status written = text.finish(); !written) return written;
        std::string piece(std::size_t{1} << 20, '\0');
        for (std::uint64_t at = 0; at < size_;) {
            const std::int64_t got = platform::read_at(file_.get(), at, piece);
            if (got <= 0) return failure();
            if (Status written = out.write({piece.data(), static_cast<std::size_t>(got)}); !written) return written;
            at += static_cast<std::uint64_t>(got);
        }
        return Success{};
    }

private:
    static Error failure() {
        return {ErrorCode::unwritable, "A temporary file beside the USD text cannot be written: is there room?"};
    }

    FileDescriptor file_;
    std::uint64_t size_ = 0;
};

/// The time samples of one attribute: declared when the first frame has it.
struct SampledAttribute {
    std::string declared; ///< "point3f[] points", with what belongs behind the name
    WaitingText samples;
};

/// Every attribute of a mesh whose faces change.
class MomentSamples {
public:
    explicit MomentSamples(const std::filesystem::path& folder) : folder_(folder) {}

    Status add(std::size_t frame, const MeshMoment& moment, const RunContext& context) {
        const Mesh& mesh = moment.mesh;
        is_first_ = frame == 0;
        if (is_first_) origin_ = mesh.origin;
        std::vector<Vec3f> points;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            points.push_back((mesh.world_position(v) - origin_).cast<float>());
        const Box box = bounds(points);
        count_ = 0;
        add(frame, "point3f[] points", points);
        add(frame, "float3[] extent", std::array<Vec3f, 2>{box.min.cast<float>(), box.max.cast<float>()});
        add(frame, "int[] faceVertexCounts", face_sizes(mesh));
        add(frame, "int[] faceVertexIndices", mesh.corners);
        add(frame, "normal3f[] normals", vertex_normals(mesh, mesh.positions, context));
        if (!mesh.colors.empty()) add(frame, "color3f[] primvars:displayColor", display_colors(mesh));
        if (!moment.velocities.empty()) add(frame, "vector3f[] velocities", moment.velocities);
        for (const VertexScalar& scalar : mesh.scalars) {
            if (scalar.name != "origin") continue;
            std::vector<std::int64_t> origin;
            for (const float v : scalar.values) origin.push_back(static_cast<std::int64_t>(v));
            add(frame, "int[] primvars:origin", origin);
        }
        if (count_ == attributes_.size()) return Success{};
        return Error{ErrorCode::unsuitable, "Frame " + std::to_string(frame) +
                                                " lacks colours, velocities or origins that the first frame has."};
    }

    /// Of all points: the first mesh's.
    const Vec3d& origin() const { return origin_; }

    Status append_to(FileWriter& out) {
        for (const auto& attribute : attributes_) {
            const std::string& name = attribute->declared;
            const bool is_a_vertex = name.find("normals") != name.npos || name.find("primvars:") != name.npos;
            std::string opening;
            if (is_a_vertex) opening = "    " + name + std::string(kVertex);
            opening += "    " + name + ".timeSamples = {\n";
            if (Status written = out.write(opening); !written) return written;
            if (Status written = attribute->samples.append_to(out); !written) return written;
            if (Status written = out.write("    }\n"); !written) return written;
        }
        return Success{};
    }

private:
    std::filesystem::path folder_;
    std::vector<std::unique_ptr<SampledAttribute>> attributes_;
    Vec3d origin_ = Vec3d::Zero();
    bool is_first_ = true;
    std::size_t count_ = 0; ///< attributes of the frame at hand

    template <class Items>
    void add(std::size_t frame, const char* declared, const Items& items) {
        if (is_first_) attributes_.emplace_back(new SampledAttribute{declared, WaitingText(folder_)});
        for (const auto& attribute : attributes_)
            if (attribute->declared == declared) {
                attribute->samples.text.sample(frame, items);
                ++count_;
            }
    }
};

} // namespace

Status write_usda(const MeshAnimation& animation, const std::filesystem::path& path, std::vector<std::string>& warnings,
                  const RunContext& context) {
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    UsdText out(*file);
    write_header(out, animation.frames, animation.frames_per_second, animation.rest->origin, animation.metres_per_unit);
    write_faces(out, *animation.rest);
    write_uvs(out, *animation.rest);
    write_colors(out, *animation.rest);
    if (Status moved = TimeSamples(animation, out, context).write(); !moved) return moved;
    out.text("}\n");
    if (Status written = out.finish(); !written) return written;
    if (context.is_cancelled()) return cancelled_error();
    context.report("writing", 1);
    add_warnings(animation, warnings);
    return file->finish();
}

Status write_usda_moments(const FrameSource<MeshMoment>& moments, const std::filesystem::path& path,
                          std::vector<std::string>& warnings, const RunContext& context) {
    if (moments.frames == 0) return Error{ErrorCode::unsuitable, path.string() + ": there are no frames to write."};
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    MomentSamples samples(std::filesystem::absolute(path).parent_path());
    std::size_t bytes = 0;
    for (std::size_t frame = 0; frame < moments.frames; ++frame) {
        context.report("writing", double(frame) / double(moments.frames));
        if (context.is_cancelled()) return cancelled_error();
        const Result<MeshMoment> now = moments.frame(frame);
        if (!now) return now.error();
        if (Status added = samples.add(frame, *now, context); !added) return added;
        bytes += 200 * now->mesh.vertex_count();
    }
    UsdText header(*file);
    write_header(header, moments.frames, moments.frames_per_second, samples.origin(), 1);
    header.text("    uniform token subdivisionScheme = \"none\"\n");
    if (Status written = header.finish(); !written) return written;
    if (Status written = samples.append_to(*file); !written) return written;
    if (Status written = file->write("}\n"); !written) return written;
    context.report("writing", 1);
    if (bytes > kLargeText)
        warnings.push_back("The USD text is about " + std::to_string(bytes / 1'000'000) +
                           " MB, which programs open slowly; a folder of meshes (NAME/) is half of it.");
    return file->finish();
}

} // namespace filigree
