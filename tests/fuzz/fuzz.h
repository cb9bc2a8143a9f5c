// What every fuzz target has: it takes bytes, and stops the program where something is wrong. libFuzzer runs it for
// scripts/fuzz; replay.cpp for scripts/test.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

/// Looks at one input. Always 0.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace filigree_fuzz {

using namespace filigree;

/// Inputs to begin with, made by the target.
std::vector<std::string> seeds();

inline const RunContext kContext(1);

/// Stops the program, so that the input is kept.
inline void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "fuzz: not so: %s\n", what);
    std::abort();
}

/// An error has its sentence.
template <class T>
bool is_sound(const Result<T>& result) {
    if (!result) require(!result.error().message.empty(), "an error has a sentence");
    return result.ok();
}

/// Takes numbers off the front of bytes; zeros when they are used up.
class Bytes {
public:
    Bytes(const std::uint8_t* data, std::size_t size) : left_(reinterpret_cast<const char*>(data), size) {}
    unsigned byte() {
        if (left_.empty()) return 0;
        const auto value = static_cast<unsigned char>(left_[0]);
        left_.remove_prefix(1);
        return value;
    }
    bool empty() const { return left_.empty(); }
    std::string_view rest() const { return left_; }

private:
    std::string_view left_;
};

/// A mesh that bytes describe: vertices on a small grid, so that many lie at one place, in a line or in a plane; faces
/// of three to six corners, some twice at one vertex.
inline Mesh mesh_of(Bytes& bytes) {
    Mesh mesh;
    const unsigned vertices = 1 + bytes.byte() % 40, faces = bytes.byte() % 80, grid = 1 + bytes.byte() % 16;
    for (unsigned v = 0; v < vertices; ++v) {
        const unsigned a = bytes.byte(), b = bytes.byte();
        mesh.positions.emplace_back(float(a % grid), float(b % grid), float((a / 16 + b / 16) % grid));
    }
    for (unsigned f = 0; f < faces && !bytes.empty(); ++f) {
        const unsigned kind = bytes.byte();
        std::vector<Index> face(kind % 4 ? 3 : 3 + kind / 4 % 4);
        for (Index& v : face) v = bytes.byte() % vertices;
        mesh.add_face(face);
    }
    return mesh;
}

/// The bytes of so many random meshes, and of a closed one, as seeds.
inline std::vector<std::string> mesh_seeds(int count = 24) {
    std::vector<std::string> all;
    std::uint32_t state = 1;
    for (int seed = 0; seed < count; ++seed) {
        std::string bytes;
        for (int k = 0; k < 20 + 12 * seed; ++k) {
            state = state * 1664525 + 1013904223;
            bytes.push_back(char(state >> 24));
        }
        all.push_back(bytes);
    }
    // A closed one: a tetrahedron.
    all.push_back(std::string({3, 4, 7, 0, 0, 5, 0, 0, 5, 85, 85, 1, 0, 2, 1, 1, 0, 1, 3, 1, 1, 2, 3, 1, 2, 0, 3}));
    return all;
}

} // namespace filigree_fuzz
