// Draco: a scan coded at its quickest and its best, bits a vertex, error and how fast it decodes.
#include "peer.h"

#include <cmath>
#include <string>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

namespace {

std::unique_ptr<draco::Mesh> mesh_of(const peer::Triangles& triangles) {
    auto mesh = std::make_unique<draco::Mesh>();
    mesh->set_num_points(static_cast<std::uint32_t>(triangles.positions.size()));
    draco::GeometryAttribute position;
    position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
    const int id = mesh->AddAttribute(position, true, mesh->num_points());
    for (std::uint32_t v = 0; v < mesh->num_points(); ++v)
        mesh->attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), triangles.positions[v].data());
    mesh->SetNumFaces(triangles.faces.size());
    for (std::uint32_t f = 0; f < triangles.faces.size(); ++f) {
        draco::Mesh::Face face;
        for (std::size_t k = 0; k < 3; ++k) face[k] = triangles.faces[f][k];
        mesh->SetFace(draco::FaceIndex(f), face);
    }
    return mesh;
}

void measure(const peer::Triangles& triangles, int bits, int level) {
    const auto mesh = mesh_of(triangles);
    draco::ExpertEncoder encoder(*mesh);
    encoder.SetSpeedOptions(10 - level, 10 - level);
    encoder.SetAttributeQuantization(0, bits);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    draco::EncoderBuffer code;
    if (!encoder.EncodeToBuffer(&code).ok()) peer::give_up("Draco could not encode the mesh");
    const double time = peer::median_seconds(7, [&] {
        draco::DecoderBuffer buffer;
        buffer.Init(code.data(), code.size());
        draco::Decoder decoder;
        if (!decoder.DecodeMeshFromBuffer(&buffer).ok()) peer::give_up("Draco could not decode its own code");
    });
    const double vertices = double(triangles.positions.size());
    const std::string name = "draco.cl" + std::to_string(level) + "_" + std::to_string(bits);
    peer::report((name + "_bits").c_str(), 8 * double(code.size()) / vertices, "bits/vertex");
    peer::report((name + "_decode").c_str(), vertices / time, "vertices/s");
}

} // namespace

int main(int argc, char** argv) {
    const peer::Triangles mesh = peer::read_argument(argc, argv);
    for (const int bits : {12, 14})
        for (const int level : {7, 10}) measure(mesh, bits, level);
}
