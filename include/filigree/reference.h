// The method of the student's report (docs/reference-code.md): detail of regular quad meshes, level by level.
//
//     const ReferenceModel model = strip_to_reference(make_wavy_cube({.resolution = 64})).value();
//     std::vector<Vec3f> driver = driver_positions(model);   // move these
//     const Mesh restored = restore_reference(model, driver).value();
//
// Each removed vertex is kept as signed barycentric coordinates and a height over three, four or six reference points
// of the next coarser level; a law says how the height changes. It is a study: for any other use take strip.h, which
// works on all meshes and is more exact.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Options and detail

/// The factor s by which the height of detail changes when its surroundings change their size.
enum class HeightLaw {
    keep,         ///< s = 1
    inverse,      ///< s = old width / new width (the report, eq. 2.14)
    proportional, ///< s = sqrt(new area / old area): exact under uniform scale
    volume,       ///< s = old area / new area
};

/// How a mesh is stripped.
struct ReferenceOptions {
    unsigned references = 3;  ///< 3 (the report), 4 or 6
    unsigned max_levels = 16; ///< most subdivisions to undo, 1 to 16
    std::optional<std::size_t> base =
        {}; ///< instead: the number of subdivisions that brings the driver closest to this size, 3 or more
    bool operator==(const ReferenceOptions&) const = default;
};

/// The detail of a regular mesh, coarse to fine.
struct ReferenceDetail {
    RegularPatches patches;
    unsigned references = 3;
    float extent = 0;               ///< largest absolute coordinate of the mesh at rest, model units
    std::vector<Vec3f> rest_driver; ///< level 0 at rest, ascending by vertex id
    /// (v, w, h) of each vertex that is not in level 0, h in model units. Level by level, and in each: first the edges
    /// of the base mesh, by the lower of their half-edges 4 patch + side (sides in the order of the base quad's
    /// corners), in that half-edge's direction and as seen from its patch; then patch by patch, row by row, cell by
    /// cell: the edge point on the cell's lower edge (not in row 0), the one on its left edge (not in column 0), and
    /// its centre.
    std::vector<Vec3f> records;
    /// Records, ascending, of points whose references at rest span no plane, or that lie too far from them: their
    /// numbers are an offset from the first reference in the basis of the base quad, and no law applies.
    std::vector<Index> loose;
};

// ---------------------------------------------------------------------------------------------------------------------
// Models

/// A mesh stripped by the reference code.
struct ReferenceModel {
    Mesh mesh;                 ///< the finest level, as it came in
    std::vector<Level> levels; ///< coarse to fine, without the finest; levels[0] is the driver
    ReferenceDetail detail;

    /// The number of the finest level; levels 0 .. finest_level() exist.
    unsigned finest_level() const { return static_cast<unsigned>(levels.size()); }
    const Level& driver() const { return levels.front(); }
};

/// Takes the detail off a mesh of quads with subdivision connectivity (find_regular_patches, mesh.h). The same bytes
/// for any number of threads. Cost O(V). Errors: usage (an option out of range; check_mesh refuses the mesh),
/// unsuitable (no subdivision connectivity; the sentence says where), cancelled.
Result<ReferenceModel> strip_to_reference(Mesh mesh, const ReferenceOptions& options = {},
                                          const RunContext& context = RunContext());

struct ReferenceRestoreOptions {
    HeightLaw law = HeightLaw::inverse;
    std::optional<unsigned> level = {}; ///< restore up to this level; unset: the finest
};

/// The mesh of a level, restored from positions of its driver (in the order of driver().vertices, relative to the
/// mesh's origin). Normals are computed where the mesh had normals; other attributes are unchanged. Cost O(V). For many
/// poses, prepare a ReferenceRestorer. Errors: usage (no such level), mismatch (another number of positions than driver
/// vertices), cancelled.
Result<Mesh> restore_reference(const ReferenceModel& model, std::span<const Vec3f> driver,
                               const ReferenceRestoreOptions& options = {}, const RunContext& context = RunContext());

/// Level k as a mesh of its own at rest, 0 <= k <= finest_level(). Cost O(size of the mesh).
Mesh level_mesh(const ReferenceModel& model, unsigned level);
/// The driver's rest positions, in the driver's order.
std::vector<Vec3f> driver_positions(const ReferenceModel& model);

/// The first thing wrong with a model, as a sentence, or "" when it can be restored. Cost O(size).
std::string check_model(const ReferenceModel& model);

// ---------------------------------------------------------------------------------------------------------------------
// Restoring many poses

/// Restores a regular mesh from positions of its driver, again and again. Safe from many threads.
class ReferenceRestorer {
public:
    /// Prepares the records for a law. Keeps a reference to `detail`. Cost O(V).
    ReferenceRestorer(const ReferenceDetail& detail, HeightLaw law, const RunContext& context);
    ReferenceRestorer(const ReferenceDetail&&, HeightLaw, const RunContext&) = delete;
    ~ReferenceRestorer();
    ReferenceRestorer(ReferenceRestorer&&) noexcept;
    ReferenceRestorer& operator=(ReferenceRestorer&&) noexcept;

    /// Ids in the finest mesh of the vertices of level k, ascending; level 0 is the driver. Cost O(V).
    std::vector<Index> level_vertices(unsigned level) const;
    /// The quads of level k over the finest mesh's vertex ids, patch by patch, row by row.
    std::vector<std::array<Index, 4>> level_quads(unsigned level) const;

    /// Writes the positions of the vertices of a level to `positions`, which has one a vertex of the finest mesh;
    /// others stay. driver: positions of level_vertices(0). The same bytes for any number of threads.
    void restore(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions,
                 const RunContext& context) const;

    /// The fast form. Writes the grids of all patches: (m + 1)^2 positions each, m = 2^level, row by row. Points on
    /// borders are in every patch that has them, with the same bytes. positions.size() = patch_count (m + 1)^2.
    void restore_grids(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions,
                       const RunContext& context) const;

    /// Bytes of records that restore_grids reads for the finest level.
    std::size_t code_bytes() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Files

/// Reads a model of the reference code; "-" is standard input. Nothing in the file is trusted. Errors: not_found,
/// bad_file, unsuitable (a model of strip()), out_of_memory, cancelled.
Result<ReferenceModel> read_reference_model(const std::filesystem::path& path,
                                            const RunContext& context = RunContext());

/// The bytes of the file. The same model gives the same bytes.
std::string write_reference_model(const ReferenceModel& model);
/// Writes a model; "-" is standard output. Errors: unwritable, out_of_memory, cancelled.
Status write_reference_model(const ReferenceModel& model, const std::filesystem::path& path,
                             const RunContext& context = RunContext());

} // namespace filigree
