// Reading and writing mesh files in memory, one thread. Rival: a copy of the same bytes.
// FILIGREE_BENCH_MESH=FILE adds that file, read from disk cache, and written in every format.
#include "filigree/file.h"
#include "filigree/io/file.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>

using namespace filigree;

namespace {

constexpr Index kSide = 640; // vertices along a side: 409,600 of them

/// A wavy sheet of triangles, so that coordinates have the digits of a scan.
Mesh make_sheet() {
    Mesh mesh;
    for (Index y = 0; y < kSide; ++y)
        for (Index x = 0; x < kSide; ++x) {
            const float u = static_cast<float>(x) / kSide, v = static_cast<float>(y) / kSide;
            mesh.positions.emplace_back(u, v, 0.1f * std::sin(17 * u) * std::cos(13 * v));
        }
    for (Index y = 0; y + 1 < kSide; ++y)
        for (Index x = 0; x + 1 < kSide; ++x) {
            const Index i = y * kSide + x;
            mesh.add_face(Triangle{i, i + 1, i + kSide});
            mesh.add_face(Triangle{i + 1, i + kSide + 1, i + kSide});
        }
    return mesh;
}

struct Format {
    const char* name;
    MeshFormat format;
    WriteMeshOptions options;
};
const Format kFormats[] = {{"obj", MeshFormat::obj, {}},
                           {"ply binary", MeshFormat::ply, {}},
                           {"ply big-endian", MeshFormat::ply, {.big_endian = true}},
                           {"ply ascii", MeshFormat::ply, {.ascii = true}},
                           {"stl binary", MeshFormat::stl, {}},
                           {"stl ascii", MeshFormat::stl, {.ascii = true}},
                           {"off", MeshFormat::off, {}}};

void set_bytes(benchmark::State& state, std::size_t bytes) {
    state.SetBytesProcessed(static_cast<std::int64_t>(bytes) * static_cast<std::int64_t>(state.iterations()));
}

void read(benchmark::State& state, const Mesh& mesh, const Format& format) {
    std::string bytes;
    const auto written = write_mesh(mesh, format.format, bytes, format.options, RunContext());
    if (!written.ok()) return state.SkipWithError(written.error().message.c_str());
    const RunContext context(1);
    for (auto _ : state) {
        Result<MeshFile> file = read_mesh(bytes, std::string("bench.") + format.name, context);
        if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
        benchmark::DoNotOptimize(file->mesh.positions.data());
    }
    set_bytes(state, bytes.size());
}

void write(benchmark::State& state, const Mesh& mesh, const Format& format) {
    std::size_t size = 0;
    for (auto _ : state) {
        std::string bytes;
        const auto written = write_mesh(mesh, format.format, bytes, format.options, RunContext());
        if (!written.ok()) return state.SkipWithError(written.error().message.c_str());
        benchmark::DoNotOptimize(bytes.data());
        size = bytes.size();
    }
    set_bytes(state, size);
}

/// What nothing that keeps the bytes can beat.
void copy(benchmark::State& state, const Mesh& mesh, const Format& format) {
    std::string bytes;
    if (!write_mesh(mesh, format.format, bytes, format.options, RunContext()).ok())
        return state.SkipWithError("not written");
    for (auto _ : state) {
        const std::unique_ptr<char[]> target(new char[bytes.size()]);
        std::memcpy(target.get(), bytes.data(), bytes.size());
        benchmark::DoNotOptimize(target.get());
        benchmark::ClobberMemory();
    }
    set_bytes(state, bytes.size());
}

void read_from_disk(benchmark::State& state, const std::string& path) {
    const RunContext context(1);
    for (auto _ : state) {
        Result<MeshFile> file = read_mesh(std::filesystem::path(path), context);
        if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
        benchmark::DoNotOptimize(file->mesh.positions.data());
    }
    set_bytes(state, std::filesystem::file_size(path));
}

void register_all(const std::string& name, const Mesh& mesh) {
    const auto add = [&](const char* what, const Format& format, auto function) {
        const std::string title = "mesh_file/" + std::string(what) + "/" + format.name + "/" + name;
        benchmark::RegisterBenchmark(title.c_str(), [&mesh, &format, function](benchmark::State& state) {
            function(state, mesh, format);
        })->Unit(benchmark::kMillisecond);
    };
    for (const Format& format : kFormats) {
        add("read", format, read);
        add("write", format, write);
        add("copy", format, copy);
    }
}

[[maybe_unused]] const bool kRegistered = [] {
    static const Mesh sheet = make_sheet();
    register_all("sheet", sheet);
    const char* const path = std::getenv("FILIGREE_BENCH_MESH");
    if (!path) return true;
    Result<MeshFile> file = read_mesh(std::filesystem::path(path), RunContext(1));
    if (!file.ok()) {
        std::cerr << file.error().message << '\n';
        return false;
    }
    static const Mesh mesh = std::move(file->mesh);
    benchmark::RegisterBenchmark("mesh_file/read_from_disk/file", [path](benchmark::State& state) {
        read_from_disk(state, path);
    })->Unit(benchmark::kMillisecond);
    register_all("file", mesh);
    return true;
}();

} // namespace
