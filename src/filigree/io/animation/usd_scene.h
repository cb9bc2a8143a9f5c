// An animated USD text: its meshes as one, in the world, with Y up.
#pragma once

#include "filigree/file.h"
#include "filigree/io/animation/usd_layer.h"
#include "filigree/io/system/file.h"

#include <Eigen/Geometry>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// The Mesh prims of a file, one after the other, without what is invisible, inactive, a guide or a proxy. Points
/// between two samples are interpolated; outside of all they are held. The samples stay in the file until they are
/// asked for.
class UsdScene {
public:
    /// keep_axes: leave Z up where the file says so. Errors: not_found, out_of_memory; bad_file (with the line),
    /// unsupported (binary; composed of several files; faces that change), unsuitable (no mesh). Memory: the text while
    /// it is opened.
    static Result<UsdScene> open(const std::filesystem::path& path, bool keep_axes);
    UsdScene(UsdScene&&) noexcept;
    UsdScene& operator=(UsdScene&&) noexcept;
    ~UsdScene();

    /// Faces, objects (where there are several meshes), and the points outside of time, or of the first sample.
    const Mesh& mesh() const { return mesh_; }
    double metres_per_unit() const { return metres_per_unit_; }
    double frames_per_second() const { return rate_; }
    /// Number of frames at a rate. Errors: unsuitable (nothing moves; too many).
    Result<std::size_t> frames(double rate) const;
    /// World positions at frame `frame` of a rate. out: one a vertex. Errors: bad_file (also another number of points
    /// than the mesh has), not_found.
    Status positions(std::size_t frame, double rate, std::span<Vec3d> out) const;

private:
    struct Transform;
    struct Part;
    class Builder;
    UsdScene();

    std::string name_;
    std::unique_ptr<FileReader> file_;
    Mesh mesh_;
    std::vector<Part> parts_;
    double metres_per_unit_ = 0, codes_per_second_ = 24, rate_ = 24;
    double first_ = 0, last_ = 0; ///< time codes
    bool has_samples_ = false;
    Mat3d turn_ = Mat3d::Identity();

    Status place(const Part& part, std::optional<double> time, std::span<Vec3d> out) const;
    Result<std::vector<double>> points_of(const UsdValue& value) const;
};

/// The file's mesh at rest, for a command line that gives no other. Errors: as of UsdScene::open.
Result<Mesh> read_usd_mesh(const std::filesystem::path& path);

/// As open_poses, from the file's points in their order.
Result<FrameSource<Pose>> open_usd_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                         const PoseFileOptions& options);

} // namespace filigree
