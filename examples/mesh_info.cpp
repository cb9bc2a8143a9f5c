// What a mesh is made of, and what is wrong with it, with places.
#include <filigree/filigree.h>

#include <array>
#include <cstdio>

using namespace filigree;

int main() {
    const RunContext context;
    Mesh torus = make_torus({.resolution = 24});
    const TopologyReport whole = analyse_topology(torus, context);
    std::printf("torus: %zu vertices, %zu faces, Euler number %lld, closed: %s, manifold: %s\n", whole.vertices,
                whole.faces, static_cast<long long>(whole.euler), whole.is_closed() ? "yes" : "no",
                whole.is_manifold() ? "yes" : "no");

    // A fin on the edge between the first face's first two corners makes that edge belong to three faces.
    const Index a = torus.corners[0], b = torus.corners[1], tip = static_cast<Index>(torus.vertex_count());
    torus.positions.push_back(Vec3f(0, 0, 1));
    torus.add_face(std::array{a, b, tip});
    const TopologyReport finned = analyse_topology(torus, context);
    for (const std::vector<Index>& edge : finned.nonmanifold_edges.places)
        std::printf("non-manifold edge %u-%u\n", edge[0], edge[1]);

    const bool whole_is_right = whole.euler == 0 && whole.is_closed() && whole.is_manifold() && whole.is_oriented();
    const bool fin_is_found = finned.nonmanifold_edges.count == 1 && finned.open_edges.count == 2;
    return whole_is_right && fin_is_found ? 0 : 1;
}
