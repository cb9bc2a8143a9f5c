// OpenSubdiv: a cube of 6,146 vertices refined four times to 1,572,866, by stencils and level by level.
// It carries no detail and no gradients: this is the speed of the smooth surface alone.
#include "peer.h"

#include <map>
#include <memory>

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/osd/cpuEvaluator.h>

using namespace OpenSubdiv;

namespace {

constexpr int kResolution = 32;
constexpr int kLevels = 4;
constexpr int kRounds = 7;

struct Vertex {
    float x = 0, y = 0, z = 0;
    void Clear() { x = y = z = 0; }
    void AddWithWeight(const Vertex& other, float weight) {
        x += weight * other.x;
        y += weight * other.y;
        z += weight * other.z;
    }
};

struct Quads {
    std::vector<Vertex> positions;
    std::vector<int> sizes, corners;
};

// The surface of a cube with kResolution^2 quads a side.
Quads make_cube() {
    Quads cube;
    std::map<std::array<int, 3>, int> vertex_at;
    const auto vertex = [&](const std::array<int, 3>& at) {
        const auto [entry, is_new] = vertex_at.try_emplace(at, static_cast<int>(cube.positions.size()));
        if (is_new) cube.positions.push_back({float(at[0]), float(at[1]), float(at[2])});
        return entry->second;
    };
    for (int axis = 0; axis < 3; ++axis) {
        for (const bool far_side : {false, true}) {
            for (int i = 0; i < kResolution; ++i) {
                for (int j = 0; j < kResolution; ++j) {
                    std::array<std::array<int, 2>, 4> ring = {{{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}};
                    if (!far_side) std::reverse(ring.begin(), ring.end());
                    for (const auto& [u, v] : ring) {
                        std::array<int, 3> at{};
                        at[axis] = far_side ? kResolution : 0;
                        at[(axis + 1) % 3] = u;
                        at[(axis + 2) % 3] = v;
                        cube.corners.push_back(vertex(at));
                    }
                    cube.sizes.push_back(4);
                }
            }
        }
    }
    return cube;
}

Far::TopologyRefiner* make_refiner(const Quads& cube) {
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(cube.positions.size());
    descriptor.numFaces = static_cast<int>(cube.sizes.size());
    descriptor.numVertsPerFace = cube.sizes.data();
    descriptor.vertIndicesPerFace = cube.corners.data();
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    return Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK, {}));
}

} // namespace

int main() {
    const Quads cube = make_cube();
    std::unique_ptr<Far::TopologyRefiner> refiner;
    std::unique_ptr<const Far::StencilTable> stencils;
    const double refine_time = peer::seconds([&] {
        refiner.reset(make_refiner(cube));
        refiner->RefineUniform(Far::TopologyRefiner::UniformOptions(kLevels));
    });
    const double table_time = peer::seconds([&] {
        Far::StencilTableFactory::Options options;
        options.generateIntermediateLevels = false;
        options.generateOffsets = true;
        stencils.reset(Far::StencilTableFactory::Create(*refiner, options));
    });
    const double fine_count = stencils->GetNumStencils();
    peer::report("opensubdiv.vertices", fine_count, "vertices");
    peer::report("opensubdiv.setup", refine_time + table_time, "s");
    peer::report("opensubdiv.table",
                 4.0 * (double(stencils->GetSizes().size()) + double(stencils->GetOffsets().size()) +
                        double(stencils->GetControlIndices().size()) + double(stencils->GetWeights().size())),
                 "bytes");

    std::vector<Vertex> fine(static_cast<std::size_t>(fine_count));
    const double by_stencils = peer::median_seconds(kRounds, [&] {
        const Osd::BufferDescriptor layout(0, 3, 3);
        Osd::CpuEvaluator::EvalStencils(&cube.positions[0].x, layout, &fine[0].x, layout, stencils->GetSizes().data(),
                                        stencils->GetOffsets().data(), stencils->GetControlIndices().data(),
                                        stencils->GetWeights().data(), 0, stencils->GetNumStencils());
    });
    peer::report("opensubdiv.stencils", fine_count / by_stencils, "vertices/s");

    std::vector<std::vector<Vertex>> levels = {cube.positions};
    for (int level = 1; level <= kLevels; ++level) levels.emplace_back(refiner->GetLevel(level).GetNumVertices());
    const Far::PrimvarRefiner primvar_refiner(*refiner);
    const double by_levels = peer::median_seconds(kRounds, [&] {
        for (int level = 1; level <= kLevels; ++level) {
            Vertex* out = levels[level].data();
            primvar_refiner.Interpolate(level, levels[level - 1].data(), out);
        }
    });
    peer::report("opensubdiv.levels", fine_count / by_levels, "vertices/s");
}
