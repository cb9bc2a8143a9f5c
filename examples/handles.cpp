// Pull a part by hand: the driver follows as rigidly as it can, and takes the detail along.
#include <filigree/filigree.h>

#include <cstdio>

using namespace filigree;

int main() {
    const RunContext context;
    const Model model = strip(make_cylinder({.resolution = 32}), {.base = 300}, context).value().model;
    const Mesh driver = level_mesh(model, 0);

    // Both ends are handles: the left one stays, the right one goes up.
    const Box box = bounds(driver.positions);
    const Vec3f lift(0, 0, 1);
    std::vector<Index> handles;
    std::vector<Vec3f> targets;
    for (Index v = 0; v < driver.vertex_count(); ++v) {
        const Vec3f p = driver.positions[v];
        const bool at_left = double(p.x())<box.min.x() + 0.1, at_right = double(p.x())> box.max.x() - 0.1;
        if (!at_left && !at_right) continue;
        handles.push_back(v);
        targets.push_back(at_right ? Vec3f(p + lift) : p);
    }

    HandleSolver solver =
        HandleSolver::create(driver.positions, triangulate(driver).triangles, handles, context).value();
    const HandleResult solved = solver.solve(targets, {}, context).value();
    const Restorer restorer = Restorer::create(model, {}, context).value();
    const Mesh restored = restorer.mesh(solved.pose, context).value();

    std::printf("%zu handles, %u rounds; %zu driver vertices moved %zu\n", handles.size(), solved.iterations,
                driver.vertex_count(), restored.vertex_count());
    const double height = bounds(restored.positions).size().z();
    const double at_rest = bounds(model.mesh.positions).size().z();
    return height > at_rest + 0.9 && height < at_rest + 1.5 ? 0 : 1;
}
