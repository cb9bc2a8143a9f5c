// A tube with two joints as glTF, put together by hand.
#pragma once

#include "filigree/mesh.h"

#include "io/gltf_text.h"

#include <algorithm>
#include <string>
#include <vector>

namespace filigree_test {

/// The tube of made_skins.h with the clips "Bend" (the lower joint turns by 90 degrees about z in a second), "Still"
/// (one key) and "Wave" (there and back in a second). armature: JSON members of the node above the joints, such as a
/// scale. parts: 2 gives its left and right half a mesh and a skin each. rod: hangs a tetrahedron without a skin on the
/// lower joint. morphs: the targets "bulge", of which 0.25 is there and which goes from 0 to 1 in "Bend", and
/// "narrow"; with normals.
inline std::string skinned_tube(const std::string& armature = "", int parts = 1, bool rod = false,
                                bool morphs = false) {
    using namespace filigree;
    const Mesh tube = make_cylinder({.resolution = 6, .size = 0.2, .length = 5});
    const Triangulation cut = triangulate(tube);
    GltfText file;
    std::vector<float> places, weights;
    std::vector<std::uint8_t> joints;
    for (const Vec3f& p : tube.positions) {
        places.insert(places.end(), {p.x(), p.y(), p.z()});
        const float lower = std::clamp((p.x() + 0.1f) / 0.2f, 0.0f, 1.0f);
        weights.insert(weights.end(), {1 - lower, lower, 0, 0});
        joints.insert(joints.end(), {0, 1, 0, 0});
    }
    const std::string attributes = R"("attributes":{"POSITION":)" +
                                   std::to_string(file.add(places, "VEC3", R"("min":[-1,-1,-1],"max":[1,1,1])")) +
                                   R"(,"JOINTS_0":)" + std::to_string(file.add(joints, 5121, "VEC4")) +
                                   R"(,"WEIGHTS_0":)" + std::to_string(file.add(weights, "VEC4")) + "}";
    std::string targets, names;
    if (morphs) {
        std::vector<float> bulges, narrows, turns, none;
        for (const Vec3f& p : tube.positions) {
            bulges.insert(bulges.end(), {0, p.x() > 0.2f ? 0.1f : 0.0f, 0});
            narrows.insert(narrows.end(), {0, -0.2f * p.y(), -0.2f * p.z()});
            turns.insert(turns.end(), {0.1f, 0, 0});
        }
        const std::string bounds = R"("min":[-1,-1,-1],"max":[1,1,1])";
        const auto target = [&](const std::vector<float>& moves) {
            return R"({"POSITION":)" + std::to_string(file.add(moves, "VEC3", bounds)) + R"(,"NORMAL":)" +
                   std::to_string(file.add(turns, "VEC3")) + "}";
        };
        targets = R"(,"targets":[)" + target(bulges) + "," + target(narrows) + "]";
        names = R"(,"weights":[0.25,0],"extras":{"targetNames":["bulge","narrow"]})";
    }
    // At bind the joints are at (-0.5, 0, 0) and at the origin.
    const std::string binds = std::to_string(file.add(
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "MAT4"));
    std::string meshes, nodes, skins, roots;
    for (int part = 0; part < parts; ++part) {
        std::vector<std::uint16_t> indices;
        for (const Triangle& t : cut.triangles) {
            const bool is_right = tube.positions[t[0]].x() + tube.positions[t[1]].x() + tube.positions[t[2]].x() > 0;
            if (parts == 1 || is_right == (part == 1)) indices.insert(indices.end(), t.begin(), t.end());
        }
        const std::string number = std::to_string(part), comma = part > 0 ? "," : "";
        meshes += comma + R"({"primitives":[{)" + attributes + R"(,"indices":)" +
                  std::to_string(file.add_indices(indices)) + targets + "}]" + names + "}";
        skins += comma + R"({"joints":[1,2],"inverseBindMatrices":)" + binds + "}";
        if (part > 0) nodes += R"({"name":"tube )" + number + R"(","mesh":)" + number + R"(,"skin":)" + number + "},";
        roots += comma + std::to_string(part == 0 ? 3 : 4);
    }
    const std::string rod_mesh = std::to_string(parts), rod_node = std::to_string(3 + parts);
    if (rod) {
        const auto corners = std::to_string(
            file.add({0, 0, 0, 0.1f, 0, 0, 0, 0.1f, 0, 0, 0, 0.1f}, "VEC3", R"("min":[0,0,0],"max":[0.1,0.1,0.1])"));
        const auto faces = std::to_string(file.add_indices({0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}));
        meshes += R"(,{"primitives":[{"attributes":{"POSITION":)" + corners + R"(},"indices":)" + faces + "}]}";
        nodes += R"({"name":"rod","mesh":)" + rod_mesh + R"(,"translation":[0.4,0.2,0]},)";
    }
    if (!nodes.empty()) nodes.pop_back();
    const auto times = std::to_string(file.add({0, 1}, "SCALAR", R"("min":[0],"max":[1])"));
    const auto turns = std::to_string(file.add({0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f}, "VEC4"));
    const auto moment = std::to_string(file.add({0}, "SCALAR", R"("min":[0],"max":[0])"));
    const auto there_and_back = std::to_string(file.add({0, 0.5f, 1}, "SCALAR", R"("min":[0],"max":[1])"));
    const auto waves = std::to_string(file.add({0, 0, 0, 1, 0, 0, 0.38268343f, 0.92387953f, 0, 0, 0, 1}, "VEC4"));
    const auto turn = std::to_string(file.add({0, 0, 0, 1}, "VEC4"));
    const auto weights_of = std::to_string(file.add({0, 0, 1, 0}, "SCALAR"));
    const auto clip = [&](const std::string& name, const std::string& input, const std::string& output) {
        const bool bulges = morphs && name == "Bend";
        return R"({"name":")" + name + R"(","samplers":[{"input":)" + input + R"(,"output":)" + output + "}" +
               (bulges ? R"(,{"input":)" + input + R"(,"output":)" + weights_of + "}" : "") +
               R"(],"channels":[{"sampler":0,"target":{"node":2,"path":"rotation"}})" +
               (bulges ? R"(,{"sampler":1,"target":{"node":3,"path":"weights"}})" : "") + "]}";
    };
    return file.text(R"("scene":0,"scenes":[{"nodes":[0,)" + roots + R"(]}],"meshes":[)" + meshes + R"(],"skins":[)" +
                     skins + R"(],"nodes":[{"name":"armature","children":[1])" + (armature.empty() ? "" : ",") +
                     armature + R"(},{"name":"upper","translation":[-0.5,0,0],"children":[2]},)" +
                     R"({"name":"lower","translation":[0.5,0,0])" + (rod ? R"(,"children":[)" + rod_node + "]" : "") +
                     R"(},{"name":"tube","mesh":0,"skin":0})" + (nodes.empty() ? "" : "," + nodes) +
                     R"(],"animations":[)" + clip("Bend", times, turns) + "," + clip("Still", moment, turn) + "," +
                     clip("Wave", there_and_back, waves) + "]");
}

} // namespace filigree_test
