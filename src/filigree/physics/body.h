// A body: the particles inside a mesh, what they weigh, how they hang together, and the surface that touches others.
#pragma once

#include "filigree/physics/cells.h"
#include "filigree/physics/distance_field.h"
#include "filigree/physics/embedding.h"
#include "filigree/physics/material.h"
#include "filigree/physics/vectors.h"

#include <memory>
#include <optional>

namespace filigree {

/// Points of the surface that touch obstacles and other bodies and catch wind, about half a spacing apart; of rigid
/// bodies a spacing.
struct BodySurface {
    Embedding points;           ///< on the mesh's surface
    std::vector<Vec3f> normals; ///< unit, outward, at rest
    std::vector<float> areas;   ///< m^2, share of the surface
};

/// Everything about a body that does not change while it moves. Rest positions are in metres along the mesh's own axes,
/// relative to the mesh's origin times the scale.
struct Body {
    Material material;
    double scale = 1; ///< metres a model unit
    Cells cells;
    /// fem, springs: the corners of the cells. meshfree, mpm: one in each cell, at the centroid of its occupied part
    /// (and, meshfree, eight in a cell whose neighbours lie in a plane or line, so that gradients exist everywhere).
    Vectors rest;
    std::vector<float> mass;   ///< kg
    std::vector<float> volume; ///< m^3: occupied, shared out as the mass is
    /// meshfree: the corners of the cells, which carry the surface's points and are its matter for all that touches it,
    /// and go along with the particles. Of others empty: the corners are the particles.
    Embedding corners;
    BodySurface surface;
    /// Distance from the surface at rest, m, on a grid of half a spacing (wider for
    /// millions of cells): how deep what touches the body lies in it.
    /// Null for bodies of mpm.
    std::shared_ptr<const DistanceField> field;
    float field_radius = 0; ///< m: a sheet without thickness is everything closer to it than this

    double spacing() const { return cells.spacing; }
    std::size_t particle_count() const { return rest.size(); }
};

struct BodyOptions {
    double scale = 1;                ///< metres a model unit, above 0; or
    std::optional<double> size = {}; ///< m, above 0: the longest side of the mesh's box
    CellOptions cells;               ///< count: of particles, about
};

/// Parts of a closed mesh that are apart, but so near each other that cells hold both.
struct JoinedParts {
    std::size_t corners = 0;     ///< of cells that join them; 0: none, or too few to matter
    Vec3f place = Vec3f::Zero(); ///< m, where the gap is narrowest, on the body at rest
    double gap = 0;              ///< m, about: at half of these corners it is wider
};

struct BodyReport {
    CellReport cells;
    std::size_t split_cells = 0; ///< meshfree: with eight particles
    std::size_t surface_points = 0;
    double mass = 0;       ///< kg
    OutwardReport outward; ///< what of the mesh counts as turned
    JoinedParts joined;    ///< fem, springs, meshfree: parts of the mesh that move as one
    std::string warning;   ///< sentences: much is fewer than two cells across, parts are joined or turned; or ""
};

/// A body from a mesh. Errors: as make_cells; usage (check_material, scale, size, both of them).
Result<Body> make_body(const Mesh& mesh, const Material& material, const BodyOptions& options,
                       const RunContext& context, BodyReport* report = nullptr);

/// A body of whole cells without a mesh: surface points at the centres of its outer faces, split in four, or at their
/// corners if it is rigid. For tests and benchmarks.
Body make_body(Cells cells, const Material& material);
/// The same with particles alone: no surface, no field.
Body bare_body(Cells cells, const Material& material);

} // namespace filigree
