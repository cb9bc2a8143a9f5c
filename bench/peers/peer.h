// What the peers share: a clock, one line a figure, and a reader for the scans.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace peer {

/// Seconds of one call.
template <class Work>
double seconds(const Work& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The median of `rounds` calls, in seconds, after one call to warm up.
template <class Work>
double median_seconds(int rounds, const Work& work) {
    work();
    std::vector<double> times;
    for (int round = 0; round < rounds; ++round) times.push_back(seconds(work));
    std::nth_element(times.begin(), times.begin() + rounds / 2, times.end());
    return times[static_cast<std::size_t>(rounds / 2)];
}

/// One figure: "name value unit", for compare.py.
inline void report(const char* name, double value, const char* unit) {
    std::printf("%s %.6g %s\n", name, value, unit);
    std::fflush(stdout);
}

[[noreturn]] inline void give_up(const std::string& message) {
    std::fprintf(stderr, "%s\n", message.c_str());
    std::exit(1);
}

struct Triangles {
    std::vector<std::array<float, 3>> positions;
    std::vector<std::array<std::uint32_t, 3>> faces;
};

/// A PLY of triangles: ascii, as the Stanford scans are, or little-endian with float vertex properties, x y z first.
inline Triangles read_ply(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::size_t vertices = 0, faces = 0, floats = 0;
    bool ascii = false;
    std::string line;
    while (std::getline(file, line) && line != "end_header") {
        std::istringstream words(line);
        std::string first, second;
        words >> first >> second;
        if (first == "format") ascii = second == "ascii";
        if (first == "element") words >> (second == "vertex" ? vertices : faces);
        if (first == "property" && second == "float" && faces == 0) ++floats;
    }
    Triangles mesh;
    mesh.positions.resize(vertices);
    mesh.faces.resize(faces);
    std::vector<float> properties(std::max<std::size_t>(floats, 3));
    for (auto& position : mesh.positions) {
        if (ascii) {
            std::getline(file, line);
            const char* at = line.c_str();
            for (float& value : properties) {
                char* end = nullptr;
                value = std::strtof(at, &end);
                at = end;
            }
        } else {
            file.read(reinterpret_cast<char*>(properties.data()), static_cast<std::streamsize>(floats * sizeof(float)));
        }
        std::copy_n(properties.begin(), 3, position.begin());
    }
    for (auto& face : mesh.faces) {
        unsigned size = 0;
        if (ascii) {
            file >> size >> face[0] >> face[1] >> face[2];
        } else {
            size = static_cast<unsigned>(file.get());
            file.read(reinterpret_cast<char*>(face.data()), sizeof face);
        }
        if (size != 3) give_up(path + ": not a PLY of triangles that this reader knows");
    }
    if (!file || faces == 0) give_up(path + ": cannot be read");
    return mesh;
}

/// The program's first argument, a mesh file.
inline Triangles read_argument(int argc, char** argv) {
    if (argc != 2) give_up(std::string(argv[0]) + " MESH.ply");
    return read_ply(argv[1]);
}

} // namespace peer
