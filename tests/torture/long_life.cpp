// A day's work in one process: strip, pose, restore, write and read, again and again; bodies simulated frame by frame.
// Memory has to stay, and results to be at the end what they were at the beginning.
//   long_life ROUNDS FRAMES [--leak]     (--leak keeps 100 kB a round and frame, to see that it would be noticed)
#include <filigree/deform/warp_steps.h>
#include <filigree/file.h>
#include <filigree/io/system/shared_work.h>
#include <filigree/mesh.h>
#include <filigree/physics/simulation.h>
#include <filigree/pose.h>
#include <filigree/restore.h>
#include <filigree/strip.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

using namespace filigree;

namespace {

bool leaks = false, is_wrong = false;

/// Of this process, resident.
double mebibytes() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * double(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

void leak() {
    static std::vector<std::unique_ptr<char[]>> kept;
    if (!leaks) return;
    constexpr std::size_t kBytes = 100'000;
    kept.push_back(std::make_unique<char[]>(kBytes));
    std::memset(kept.back().get(), 1, kBytes);
}

/// Memory from a tenth of the way on.
class Memory {
public:
    void note(std::size_t done, std::size_t all) {
        if (done == std::max<std::size_t>(all / 10, 1)) warm_ = mebibytes();
        if (done == all) end_ = mebibytes();
    }
    double warm() const { return warm_; }
    double end() const { return end_; }
    bool is_flat() const { return end_ <= 1.05 * warm_ + 8; }

private:
    double warm_ = 0, end_ = 0;
};

/// What has one name has one value, whenever it comes.
class Results {
public:
    void expect_same(const std::string& name, const std::string& value) {
        const auto [known, is_new] = known_.emplace(name, value);
        compared_ += !is_new;
        if (is_new || known->second == value) return;
        std::fprintf(stderr, "%s is another than before\n", name.c_str());
        is_wrong = true;
    }
    std::size_t compared() const { return compared_; }

private:
    std::map<std::string, std::string> known_;
    std::size_t compared_ = 0;
};

std::string hash_of(const std::vector<Vec3f>& points) {
    return hash_of_bytes({reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Vec3f)});
}

std::string hash_of(const Vectors& points) {
    std::vector<Vec3f> all;
    for (std::size_t i = 0; i < points.size(); ++i) all.push_back(points[i]);
    return hash_of(all);
}

void report(const char* what, std::size_t count, const Memory& memory, const Results& results) {
    std::printf("%s %zu compared %zu warm_mib %.1f end_mib %.1f\n", what, count, results.compared(), memory.warm(),
                memory.end());
    std::fflush(stdout);
    if (memory.is_flat()) return;
    std::fprintf(stderr, "%s: memory grew from %.1f MiB to %.1f\n", what, memory.warm(), memory.end());
    is_wrong = true;
}

void strip_and_restore(std::size_t rounds, const RunContext& context) {
    const std::vector<Mesh> meshes = {make_wavy_cube({.resolution = 12}), make_wavy_sphere({.resolution = 24}),
                                      make_torus({.resolution = 30}), make_wavy_plane({.resolution = 33})};
    const std::string file =
        (std::filesystem::temp_directory_path() / ("long_life-" + std::to_string(getpid()) + ".fil")).string();
    Memory memory;
    Results results;
    for (std::size_t round = 0; round < rounds; ++round) {
        const std::size_t kind = round % (4 * meshes.size());
        const Mesh& mesh = meshes[kind % meshes.size()];
        const double size = 1 + double(kind / meshes.size()) * 0.1; // other warps of the same meshes
        const Model model = strip(mesh, {.base = 60}, context).value().model;
        const auto bend = make_bend(world_bounds(mesh), Axis::z, 90 * size);
        const Restorer restorer = Restorer::create(model, {}, context).value();
        const Pose pose = warp_pose(*bend, model, context);
        results.expect_same("round " + std::to_string(kind), hash_of(restorer.positions(pose, context).value()));
        if (round % 10 == 0) {
            (void)write_model(model, file, context).value();
            const Model back = read_model(file, context).value();
            results.expect_same("driver " + std::to_string(kind % meshes.size()), hash_of(driver_positions(back)));
        }
        leak();
        memory.note(round + 1, rounds);
    }
    std::filesystem::remove(file);
    report("rounds", rounds, memory, results);
}

World ground() {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{Vec3d(0, -1, 0), Vec3d::UnitY()};
    return world;
}

Simulation two_bodies(MaterialModel model, const RunContext& context) {
    Material material{.density = 1000, .young_modulus = 5e4, .poisson_ratio = 0.3};
    material.model = model;
    const auto body = std::make_shared<const Body>(
        make_body(make_wavy_cube({.resolution = 8}), material, {.cells = {.count = 120}}, context).value());
    Actor upper{body};
    upper.placement.translation() = Vec3d(0.1, 1.3, 0);
    return Simulation::create(ground(), {{body}, upper}, {}, context).value();
}

/// Half of the frames: short runs of every model, over and over. The other half: one simulation that is pushed all the
/// time.
void simulate(std::size_t frames, const RunContext& context) {
    constexpr MaterialModel kModels[] = {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree,
                                         MaterialModel::rigid};
    constexpr std::size_t kRun = 125; // frames
    Memory memory;
    Results results;
    std::size_t done = 0;
    for (std::size_t run = 0; done + kRun <= frames / 2; ++run) {
        const std::size_t kind = run % std::size(kModels);
        Simulation simulation = two_bodies(kModels[kind], context);
        for (std::size_t k = 0; k < kRun; ++k, ++done) {
            (void)simulation.advance(context).value();
            leak();
            memory.note(done + 1, frames);
        }
        results.expect_same("model " + std::to_string(kind), hash_of(simulation.positions(1)));
    }
    Simulation pushed = two_bodies(MaterialModel::fem, context);
    Vectors forces(pushed.positions(0));
    for (std::size_t frame = 0; done < frames; ++frame, ++done) {
        const double side = frame / 40 % 2 ? 2 : -2; // N a particle
        for (std::size_t i = 0; i < forces.size(); ++i) forces.set(i, Vec3f(float(side), 0, 0));
        (void)pushed.set_forces(0, forces).value();
        (void)pushed.advance(context).value();
        leak();
        memory.note(done + 1, frames);
    }
    for (std::size_t b = 0; b < 2; ++b)
        for (std::size_t i = 0; i < pushed.positions(b).size(); ++i)
            if (!pushed.positions(b)[i].allFinite()) is_wrong = true;
    report("frames", frames, memory, results);
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 3) return std::fprintf(stderr, "long_life ROUNDS FRAMES [--leak]\n"), 2;
    leaks = argc > 3 && std::string(argv[3]) == "--leak";
    const RunContext context;
    strip_and_restore(std::size_t(std::atoll(argv[1])), context);
    simulate(std::size_t(std::atoll(argv[2])), context);
    return is_wrong ? 1 : 0;
}
