// meshoptimizer: decoding a scan's compressed positions, the ceiling of touching every vertex; and simplifying it.
#include "peer.h"

#include <cmath>
#include <limits>

#include <meshoptimizer.h>

namespace {

constexpr int kRounds = 15;
constexpr std::size_t kDriverVertices = 1000;

template <class Record>
void report_decode(const char* name, const std::vector<Record>& records) {
    std::vector<unsigned char> code(meshopt_encodeVertexBufferBound(records.size(), sizeof(Record)));
    code.resize(meshopt_encodeVertexBuffer(code.data(), code.size(), records.data(), records.size(), sizeof(Record)));
    std::vector<Record> decoded(records.size());
    const double time = peer::median_seconds(kRounds, [&] {
        if (meshopt_decodeVertexBuffer(decoded.data(), decoded.size(), sizeof(Record), code.data(), code.size()) != 0)
            peer::give_up("meshoptimizer could not decode its own code");
    });
    peer::report(name, double(records.size()) / time, "vertices/s");
}

} // namespace

int main(int argc, char** argv) {
    peer::Triangles mesh = peer::read_argument(argc, argv);
    const std::size_t vertex_count = mesh.positions.size(), index_count = 3 * mesh.faces.size();
    unsigned int* indices = mesh.faces[0].data();

    std::vector<unsigned int> driver(index_count);
    const double simplify_time = peer::seconds([&] {
        driver.resize(meshopt_simplify(driver.data(), indices, index_count, mesh.positions[0].data(), vertex_count,
                                       sizeof mesh.positions[0], 6 * kDriverVertices, 1.0f, 0, nullptr));
    });
    peer::report("meshoptimizer.simplify", simplify_time, "s");
    peer::report("meshoptimizer.simplify_faces", double(driver.size() / 3), "faces");

    // the order its own documentation asks for before encoding
    meshopt_optimizeVertexCache(indices, indices, index_count, vertex_count);
    mesh.positions.resize(meshopt_optimizeVertexFetch(mesh.positions.data(), indices, index_count,
                                                      mesh.positions.data(), vertex_count, sizeof mesh.positions[0]));
    report_decode("meshoptimizer.decode_float", mesh.positions);
}
