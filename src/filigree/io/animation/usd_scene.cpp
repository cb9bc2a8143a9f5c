#include "filigree/io/animation/usd_scene.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace filigree {

namespace {

constexpr double kSameTime = 1e-6; // of a time code

/// The samples around a time, and how far it is from the first to the second.
struct Between {
    std::size_t before, after;
    double share;
};
template <class Samples>
Between between(const Samples& samples, double time) {
    std::size_t after = 0;
    while (after < samples.size() && samples[after].time < time - kSameTime) ++after;
    if (after == 0) return {0, 0, 0};
    if (after == samples.size()) return {after - 1, after - 1, 0};
    const double from = samples[after - 1].time, to = samples[after].time;
    if (std::abs(to - time) <= kSameTime) return {after, after, 0};
    return {after - 1, after, (time - from) / (to - from)};
}

Eigen::Quaterniond rotation_of(const std::vector<double>& v) {
    const Eigen::Quaterniond rotation(v[0], v[1], v[2], v[3]);
    return rotation.norm() > 0 ? rotation.normalized() : Eigen::Quaterniond::Identity();
}

Mat3d turned(char axis, double degrees) {
    const Vec3d around = axis == 'X' ? Vec3d::UnitX() : axis == 'Y' ? Vec3d::UnitY() : Vec3d::UnitZ();
    const double half = degrees * std::numbers::pi / 360;
    const Vec3d vector = math::sin(half) * around;
    return Eigen::Quaterniond(math::cos(half), vector.x(), vector.y(), vector.z()).toRotationMatrix();
}

} // namespace

/// One operation of a transform.
struct UsdScene::Transform {
    struct Sample {
        double time;
        std::vector<double> numbers;
    };
    std::string kind; ///< "translate", "rotateXYZ"
    bool inverted = false;
    std::vector<double> still; ///< outside of time; empty: none
    std::vector<Sample> samples;

    /// How many numbers a kind has; 0: it is not known.
    static std::size_t width(std::string_view kind) {
        if (kind == "translate" || kind == "scale") return 3;
        if (kind == "orient") return 4;
        if (kind == "transform") return 16;
        if (!kind.starts_with("rotate")) return 0;
        const std::string_view axes = kind.substr(6);
        if (axes == "X" || axes == "Y" || axes == "Z") return 1;
        std::string sorted(axes);
        std::ranges::sort(sorted);
        return sorted == "XYZ" ? 3 : 0;
    }

    std::vector<double> numbers_at(std::optional<double> time) const {
        if (!time && !still.empty()) return still;
        if (samples.empty()) return still;
        const Between at = between(samples, time.value_or(samples.front().time));
        const std::vector<double>&a = samples[at.before].numbers, &b = samples[at.after].numbers;
        if (kind == "orient") {
            const Eigen::Quaterniond q = math::slerp(rotation_of(a), at.share, rotation_of(b));
            return {q.w(), q.x(), q.y(), q.z()};
        }
        std::vector<double> mixed(a.size());
        for (std::size_t k = 0; k < a.size(); ++k) mixed[k] = (1 - at.share) * a[k] + at.share * b[k];
        return mixed;
    }

    Eigen::Matrix4d matrix_at(std::optional<double> time) const {
        const std::vector<double> v = numbers_at(time);
        Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
        if (kind == "translate") {
            matrix.topRightCorner<3, 1>() = Vec3d(v[0], v[1], v[2]);
        } else if (kind == "scale") {
            matrix.topLeftCorner<3, 3>() = Vec3d(v[0], v[1], v[2]).asDiagonal();
        } else if (kind == "orient") {
            matrix.topLeftCorner<3, 3>() = rotation_of(v).toRotationMatrix();
        } else if (kind == "transform") { // row after row, for row vectors
            for (int column = 0; column < 4; ++column)
                for (int row = 0; row < 4; ++row) matrix(row, column) = v[std::size_t(4 * column + row)];
        } else {
            Mat3d rotation = Mat3d::Identity();
            for (std::size_t k = 0; k < v.size(); ++k) rotation = turned(kind[6 + k], v[k]) * rotation;
            matrix.topLeftCorner<3, 3>() = rotation;
        }
        return inverted ? Eigen::Matrix4d(matrix.inverse()) : matrix;
    }
};

/// One Mesh prim.
struct UsdScene::Part {
    std::size_t first = 0, count = 0; ///< its vertices
    std::size_t line = 0;
    UsdValue still; ///< points outside of time
    std::vector<UsdSample> samples;
    std::vector<Transform> transforms; ///< from the root down
};

/// Makes a scene of a layer.
class UsdScene::Builder {
public:
    Builder(std::string_view text, const UsdLayer& layer, UsdScene& scene)
        : text_(text), layer_(layer), scene_(scene) {}

    Status build(bool keep_axes) {
        if (Status read = read_stage(keep_axes); !read) return read;
        std::vector<std::string> names;
        std::vector<std::size_t> faces;
        for (std::size_t p = 0; p < layer_.prims.size(); ++p) {
            if (!is_shown(p) || layer_.prims[p].type != "Mesh") continue;
            if (Status added = add_mesh(p); !added) return added;
            names.emplace_back(layer_.prims[p].name);
            faces.push_back(scene_.mesh_.face_count());
        }
        if (scene_.parts_.empty()) return none_found();
        std::vector<Vec3d> world(scene_.mesh_.positions.size());
        for (const Part& part : scene_.parts_)
            if (Status placed = scene_.place(part, std::nullopt, std::span(world).subspan(part.first, part.count));
                !placed)
                return placed;
        split_origin(world, scene_.mesh_);
        if (names.size() > 1) {
            scene_.mesh_.objects.names = names;
            for (std::size_t k = 0; k < faces.size(); ++k) scene_.mesh_.objects.of_face.resize(faces[k], Index(k));
        }
        return Success{};
    }

private:
    std::string_view text_;
    const UsdLayer& layer_;
    UsdScene& scene_;
    double first_ = std::numeric_limits<double>::infinity(), last_ = -first_;

    std::string_view said(const UsdValue& value) const { return text_.substr(value.begin, value.end - value.begin); }
    Error error(std::size_t line, const std::string& cause, ErrorCode code = ErrorCode::bad_file) const {
        return {code, scene_.name_ + ": line " + std::to_string(line) + ": " + cause + "."};
    }
    static std::string prim_text(const UsdPrim& prim) { return "mesh '" + std::string(prim.name) + "'"; }

    Result<std::optional<double>> number_of(std::string_view key, double least) const {
        const UsdValue value = layer_.find(key);
        if (value.empty()) return std::optional<double>();
        const Result<std::vector<double>> numbers = usd_numbers(text_, value, scene_.name_);
        if (!numbers) return numbers.error();
        if (numbers->size() != 1 || !(numbers->front() > least))
            return error(value.line, std::string(key) + " makes no sense");
        return std::optional<double>(numbers->front());
    }

    Status read_stage(bool keep_axes) {
        if (!layer_.composed_by.empty())
            return error(layer_.composed_line,
                         "'" + std::string(layer_.composed_by) +
                             "' composes the scene of parts, which is not read; usdcat with its option flatten makes "
                             "one scene of it",
                         ErrorCode::unsupported);
        constexpr double kAny = -std::numeric_limits<double>::infinity();
        std::optional<double> codes, rate, start, end;
        for (const auto& [key, least, to] :
             {std::tuple("timeCodesPerSecond", 0.0, &codes), std::tuple("framesPerSecond", 0.0, &rate),
              std::tuple("startTimeCode", kAny, &start), std::tuple("endTimeCode", kAny, &end)}) {
            const Result<std::optional<double>> number = number_of(key, least);
            if (!number) return number.error();
            *to = *number;
        }
        const Result<std::optional<double>> metres = number_of("metersPerUnit", 0);
        if (!metres) return metres.error();
        scene_.metres_per_unit_ = metres->value_or(0);
        scene_.codes_per_second_ = codes.value_or(rate.value_or(24));
        scene_.rate_ = rate.value_or(scene_.codes_per_second_);
        if (start && end && *end >= *start) first_ = *start, last_ = *end, is_ranged_ = true;
        const bool z_up = said(layer_.find("upAxis")).find('Z') != std::string_view::npos;
        if (z_up && !keep_axes) scene_.turn_ << 1, 0, 0, 0, 0, 1, 0, -1, 0;
        return Success{};
    }

    bool is_ranged_ = false; ///< the file says when it begins and ends

    bool is_shown(std::size_t prim) const {
        for (std::size_t p = prim; p != UsdPrim::kNone; p = layer_.prims[p].parent) {
            const UsdPrim& at = layer_.prims[p];
            if (at.specifier != "def" || !at.active) return false;
            for (const auto& [name, value] :
                 {std::pair("visibility", "invisible"), std::pair("purpose", "guide"), std::pair("purpose", "proxy")})
                if (const UsdAttribute* of = at.find(name);
                    of && of->samples.empty() && said(of->value).find(value) != std::string_view::npos)
                    return false;
        }
        return true;
    }

    Error none_found() const { return {ErrorCode::unsuitable, scene_.name_ + ": has no mesh that is shown."}; }

    /// The only value of an attribute that must not change in time.
    Result<UsdValue> constant(const UsdPrim& prim, std::string_view name) const {
        const UsdAttribute* const found = prim.find(name);
        if (!found || (found->value.empty() && found->samples.empty()))
            return error(prim.line, prim_text(prim) + " has no " + std::string(name));
        for (const UsdSample& sample : found->samples)
            if (said(sample.value) != said(found->samples.front().value))
                return error(sample.value.line,
                             "the faces of " + prim_text(prim) +
                                 " change in time, and an animation has the same faces in all frames",
                             ErrorCode::unsuitable);
        return found->samples.empty() ? found->value : found->samples.front().value;
    }

    Result<std::vector<double>> whole_numbers(const UsdPrim& prim, std::string_view name, double least, double below) {
        const Result<UsdValue> value = constant(prim, name);
        if (!value) return value.error();
        Result<std::vector<double>> numbers = usd_numbers(text_, *value, scene_.name_);
        if (!numbers) return numbers.error();
        for (const double number : *numbers)
            if (!(number >= least && number < below && number == std::floor(number)))
                return error(value->line,
                             std::string(name) + " of " + prim_text(prim) + " has a number that is " +
                                 (number < below ? "not allowed there" : "larger than its points are many"));
        return numbers;
    }

    Status add_mesh(std::size_t number) {
        const UsdPrim& prim = layer_.prims[number];
        Part part;
        part.line = prim.line;
        const UsdAttribute* const points = prim.find("points");
        if (!points || (points->value.empty() && points->samples.empty()))
            return error(prim.line, prim_text(prim) + " has no points");
        part.still = points->value;
        part.samples = points->samples;
        const UsdValue& rest = part.still.empty() ? part.samples.front().value : part.still;
        const Result<std::vector<double>> places = usd_numbers(text_, rest, scene_.name_);
        if (!places) return places.error();
        if (places->size() % 3 != 0)
            return error(rest.line, "the points of " + prim_text(prim) + " are not three numbers each");
        part.first = scene_.mesh_.positions.size();
        part.count = places->size() / 3;
        for (const UsdSample& sample : part.samples) see_time(sample.time);
        if (Status added = add_transforms(number, part); !added) return added;
        scene_.mesh_.positions.resize(part.first + part.count, Vec3f::Zero());
        if (Status added = add_faces(prim, part); !added) return added;
        scene_.parts_.push_back(std::move(part));
        return Success{};
    }

    void see_time(double time) {
        scene_.has_samples_ = true;
        if (!is_ranged_) first_ = std::min(first_, time), last_ = std::max(last_, time);
        scene_.first_ = first_;
        scene_.last_ = last_;
    }

    Status add_faces(const UsdPrim& prim, const Part& part) {
        const Result<std::vector<double>> sizes = whole_numbers(prim, "faceVertexCounts", 0, 1e9);
        if (!sizes) return sizes.error();
        const Result<std::vector<double>> corners = whole_numbers(prim, "faceVertexIndices", 0, double(part.count));
        if (!corners) return corners.error();
        double sum = 0;
        for (const double size : *sizes) sum += size;
        if (sum != double(corners->size()))
            return error(prim.line, "the faces of " + prim_text(prim) + " have " + std::to_string(corners->size()) +
                                        " corners, and their counts sum to another number");
        const UsdAttribute* const orientation = prim.find("orientation");
        bool turned_round = orientation && said(orientation->value).find("leftHanded") != std::string_view::npos;
        Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
        for (const Transform& transform : part.transforms) world = world * transform.matrix_at(std::nullopt);
        if (world.topLeftCorner<3, 3>().determinant() < 0) turned_round = !turned_round;
        std::vector<Index> face;
        auto corner = corners->begin();
        for (const double size : *sizes) {
            face.clear();
            for (std::size_t k = 0; k < std::size_t(size); ++k) face.push_back(Index(part.first) + Index(*corner++));
            if (turned_round) std::ranges::reverse(face);
            if (face.size() >= 3) scene_.mesh_.add_face(face);
        }
        return Success{};
    }

    Status add_transforms(std::size_t number, Part& part) {
        std::vector<std::size_t> chain;
        for (std::size_t p = number; p != UsdPrim::kNone; p = layer_.prims[p].parent) chain.push_back(p);
        std::ranges::reverse(chain);
        for (const std::size_t p : chain) {
            const UsdPrim& prim = layer_.prims[p];
            const UsdAttribute* const order = prim.find("xformOpOrder");
            if (!order) continue;
            for (std::string_view word : usd_words(text_, order->value)) {
                if (word == "!resetXformStack!") {
                    part.transforms.clear();
                    continue;
                }
                Transform transform;
                constexpr std::string_view kInvert = "!invert!", kOp = "xformOp:";
                transform.inverted = word.starts_with(kInvert);
                if (transform.inverted) word.remove_prefix(kInvert.size());
                const UsdAttribute* const op = prim.find(word);
                if (!op || (op->value.empty() && op->samples.empty()) || !word.starts_with(kOp))
                    return error(order->line,
                                 "xformOpOrder names '" + std::string(word.substr(0, 40)) + "', which is not there");
                const std::string_view rest = word.substr(kOp.size());
                transform.kind = rest.substr(0, rest.find(':'));
                if (Status read = read_numbers(*op, transform); !read) return read;
                part.transforms.push_back(std::move(transform));
            }
        }
        return Success{};
    }

    Status read_numbers(const UsdAttribute& op, Transform& transform) {
        const std::size_t width = Transform::width(transform.kind);
        if (width == 0) return error(op.line, "the transform '" + transform.kind.substr(0, 40) + "' is not known");
        const auto read = [&](const UsdValue& value) -> Result<std::vector<double>> {
            Result<std::vector<double>> numbers = usd_numbers(text_, value, scene_.name_);
            if (!numbers) return numbers.error();
            if (numbers->size() != width)
                return error(value.line, "'" + transform.kind + "' needs " + std::to_string(width) +
                                             " numbers, and has " + std::to_string(numbers->size()));
            return numbers;
        };
        if (!op.value.empty()) {
            Result<std::vector<double>> numbers = read(op.value);
            if (!numbers) return numbers.error();
            transform.still = *std::move(numbers);
        }
        for (const UsdSample& sample : op.samples) {
            Result<std::vector<double>> numbers = read(sample.value);
            if (!numbers) return numbers.error();
            transform.samples.push_back({sample.time, *std::move(numbers)});
            see_time(sample.time);
        }
        const Eigen::Matrix4d matrix = transform.matrix_at(std::nullopt);
        if (!matrix.allFinite() || matrix.cwiseAbs().maxCoeff() > 1e30)
            return error(op.line, "the transform cannot be inverted");
        return Success{};
    }
};

UsdScene::UsdScene() = default;
UsdScene::UsdScene(UsdScene&&) noexcept = default;
UsdScene& UsdScene::operator=(UsdScene&&) noexcept = default;
UsdScene::~UsdScene() = default;

Result<UsdScene> UsdScene::open(const std::filesystem::path& path, bool keep_axes) {
    Result<FileReader> file = FileReader::open(path);
    if (!file) return file.error();
    UsdScene scene;
    scene.name_ = path == "-" ? "standard input" : path.string();
    scene.file_ = std::make_unique<FileReader>(std::move(*file));
    const Result<std::string> text = scene.file_->read_all();
    if (!text) return text.error();
    if (text->starts_with("PXR-USDC") || text->starts_with("PK"))
        return Error{ErrorCode::unsupported,
                     scene.name_ + ": is binary USD, which is not read; 'usdcat FILE -o FILE.usda' writes it as text, "
                                   "or import it in Blender and export .usda or .pc2."};
    const Result<UsdLayer> layer = read_usd_layer(*text, scene.name_);
    if (!layer) return layer.error();
    if (Status built = Builder(*text, *layer, scene).build(keep_axes); !built) return built.error();
    return scene;
}

Result<std::size_t> UsdScene::frames(double rate) const {
    constexpr double kMostFrames = 1e7, kRounding = 1e-6; // of a frame
    if (!has_samples_)
        return Error{ErrorCode::unsuitable, name_ + ": nothing moves: neither points nor transforms have time samples "
                                                    "(skeletons and blend shapes are not read; bake them to points)."};
    const double last = (last_ - first_) / codes_per_second_ * rate + kRounding;
    if (!(last >= 0 && last < kMostFrames))
        return Error{ErrorCode::unsuitable, name_ + ": its animation is too long for this frame rate."};
    return static_cast<std::size_t>(last) + 1;
}

Result<std::vector<double>> UsdScene::points_of(const UsdValue& value) const {
    std::string text(value.end - value.begin, '\0');
    if (Status read = file_->read(value.begin, text); !read) return read.error();
    return usd_numbers(text, {0, text.size(), value.line}, name_);
}

Status UsdScene::place(const Part& part, std::optional<double> time, std::span<Vec3d> out) const {
    Between at{0, 0, 0};
    if (time && !part.samples.empty()) at = between(part.samples, *time);
    const bool is_still = part.samples.empty() || (!time && !part.still.empty());
    const UsdValue& value = is_still ? part.still : part.samples[at.before].value;
    Result<std::vector<double>> points = points_of(value);
    if (!points) return points.error();
    const auto other_count = [&](const UsdValue& wrong, std::size_t count) {
        return Error{ErrorCode::bad_file, name_ + ": line " + std::to_string(wrong.line) + ": there are " +
                                              std::to_string(count / 3) + " points, and the mesh has " +
                                              std::to_string(part.count) + "."};
    };
    if (points->size() != 3 * part.count) return other_count(value, points->size());
    if (!is_still && at.share > 0) {
        const UsdValue& later = part.samples[at.after].value;
        const Result<std::vector<double>> next = points_of(later);
        if (!next) return next.error();
        if (next->size() != points->size()) return other_count(later, next->size());
        for (std::size_t k = 0; k < points->size(); ++k)
            (*points)[k] = (1 - at.share) * (*points)[k] + at.share * (*next)[k];
    }
    Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
    for (const Transform& transform : part.transforms) world = world * transform.matrix_at(time);
    const Mat3d linear = turn_ * world.topLeftCorner<3, 3>();
    const Vec3d shift = turn_ * world.topRightCorner<3, 1>();
    for (std::size_t v = 0; v < part.count; ++v) {
        out[v] = linear * Vec3d((*points)[3 * v], (*points)[3 * v + 1], (*points)[3 * v + 2]) + shift;
        if (!(out[v].cwiseAbs().maxCoeff() < 1e30))
            return Error{ErrorCode::bad_file, name_ + ": line " + std::to_string(value.line) + ": point " +
                                                  std::to_string(v) + " is at no place that 32-bit float can hold."};
    }
    return Success{};
}

Status UsdScene::positions(std::size_t frame, double rate, std::span<Vec3d> out) const {
    const double time = first_ + double(frame) / rate * codes_per_second_;
    for (const Part& part : parts_)
        if (Status placed = place(part, time, out.subspan(part.first, part.count)); !placed) return placed;
    return Success{};
}

Result<Mesh> read_usd_mesh(const std::filesystem::path& path) {
    const Result<UsdScene> scene = UsdScene::open(path, false);
    if (!scene) return scene.error();
    return scene->mesh();
}

Result<FrameSource<Pose>> open_usd_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                         const PoseFileOptions& options) {
    Result<UsdScene> opened = UsdScene::open(path, options.up.has_value());
    if (!opened) return opened.error();
    const auto scene = std::make_shared<const UsdScene>(*std::move(opened));
    const double rate = options.frames_per_second.value_or(scene->frames_per_second());
    const Result<std::size_t> frames = scene->frames(rate);
    if (!frames) return frames.error();
    if (const std::size_t count = scene->mesh().vertex_count(); count != points)
        return Error{ErrorCode::mismatch, path.string() + ": has " + std::to_string(count) +
                                              " points, and what it should move has " + std::to_string(points) +
                                              " vertices; it is of another mesh."};
    return FrameSource<Pose>{*frames, rate,
                             [scene, rate, points, origin](std::size_t frame) -> Result<Pose> {
                                 std::vector<Vec3d> world(points);
                                 if (Status read = scene->positions(frame, rate, world); !read) return read.error();
                                 Pose pose;
                                 pose.positions.reserve(points);
                                 for (const Vec3d& p : world) pose.positions.push_back((p - origin).cast<float>());
                                 return pose;
                             },
                             scene->metres_per_unit()};
}

} // namespace filigree
