// 200 rigid pieces that fall into a tray, heap up and come to rest.
#pragma once

#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/simulation.h"

#include <vector>

namespace filigree::bench {

inline constexpr int kHeapRests = 420; ///< frames of 1/60 s after which the heap lies still

struct Heap {
    World world;
    std::vector<Actor> actors;
};

inline Heap make_heap() {
    Heap heap;
    heap.world.body_friction = 0.5;
    heap.world.body_restitution = 0.3;
    heap.world.obstacles.emplace_back().shape = HalfSpace{};
    for (const Vec3d& side : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 0, 1), Vec3d(0, 0, -1)})
        heap.world.obstacles.emplace_back().shape = HalfSpace{-0.5 * side, side};
    Material stone;
    stone.model = MaterialModel::rigid;
    stone.density = 2600;
    std::vector<std::shared_ptr<const Body>> kinds;
    for (const auto& [x, y, z] : {std::array{3u, 3u, 3u}, {4u, 3u, 2u}, {5u, 2u, 3u}, {3u, 4u, 3u}})
        kinds.push_back(std::make_shared<Body>(
            make_body(box_cells(x, y, z, 0.025, -0.0125 * Vec3d(double(x), double(y), double(z))), stone)));
    for (int i = 0; i < 200; ++i) {
        const int x = i % 5, z = i / 5 % 5, y = i / 25;
        Actor& actor = heap.actors.emplace_back();
        actor.body = kinds[std::size_t(i % 4)];
        actor.placement.translation() =
            Vec3d(0.16 * (x - 2) + 0.01 * (y % 3), 0.1 + 0.15 * y, 0.14 * (z - 2) + 0.01 * (2 * y % 3));
        actor.placement.rotate(Eigen::AngleAxisd(0.4 * (7 * i % 16), Vec3d(1, i % 3, i % 5).normalized()));
    }
    return heap;
}

} // namespace filigree::bench
