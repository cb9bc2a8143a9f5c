// The lossless code: any words, faces, values and records come back; damaged streams are refused or give as many.
#include "fuzz.h"

#include "filigree/pack/lossless_corners.h"
#include "filigree/pack/lossless_numbers.h"

#include <algorithm>

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() { return mesh_seeds(); }

} // namespace filigree_fuzz

namespace {

std::string damaged(std::string stream, Bytes& bytes) {
    const std::size_t at = (bytes.byte() * 256 + bytes.byte()) % stream.size();
    stream[at] = char(stream[at] ^ bytes.byte());
    return stream;
}

void check_numbers(Bytes& bytes) {
    const unsigned kind = bytes.byte();
    const WordLayout layout{1 + kind % 5, (kind & 32) != 0, (kind & 64) != 0};
    const std::size_t known = bytes.byte() % 8, items = bytes.byte();
    std::vector<std::uint32_t> all((known + items) * layout.columns);
    for (std::uint32_t& word : all) word = bytes.byte() << (kind & 128 ? 22 : 0);
    std::vector<Expectation> expected(bytes.byte() % (items + 1));
    for (Expectation& e : expected) e = {bytes.byte(), bytes.byte(), bytes.byte()};
    const std::span words(all);
    const auto front = words.first(known * layout.columns), rest = words.subspan(known * layout.columns);
    const std::string code = encode_numbers(front, rest, layout, expected);
    const auto read = decode_numbers(code, front, items, layout, expected);
    require(read && std::ranges::equal(*read, rest), "numbers come back");
    const auto changed = decode_numbers(damaged(code, bytes), front, items, layout, expected);
    require(!changed || changed->size() == rest.size(), "damaged numbers are as many");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const Mesh mesh = mesh_of(bytes);
    const std::string faces = encode_corners(mesh.face_offsets, mesh.corners);
    const auto corners = decode_corners(faces, mesh.face_offsets);
    require(corners && *corners == mesh.corners, "faces come back");
    decode_corners(damaged(faces, bytes), mesh.face_offsets);

    std::vector<Index> values;
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) values.push_back(c % 5 ? mesh.corners[c] : bytes.byte() - 1u);
    const std::string of_corners = encode_values(mesh.corners, values);
    const auto read = decode_values(of_corners, mesh.corners);
    require(read && *read == values, "values come back");
    decode_values(damaged(of_corners, bytes), mesh.corners);

    std::vector<std::uint32_t> runs(bytes.byte() % 16);
    for (std::uint32_t& run : runs) run = bytes.byte() % 32;
    std::vector<std::uint16_t> records(bytes.byte());
    for (std::uint16_t& record : records) record = std::uint16_t(bytes.byte());
    std::vector<Index> near(records.size());
    for (Index& v : near) v = bytes.byte();
    const std::size_t block = 1 + bytes.byte();
    const std::string order = encode_records(records, runs, block, near);
    const auto back = decode_records(order, records.size(), runs, block, near);
    require(back && *back == records, "records come back");
    decode_records(damaged(order, bytes), records.size(), runs, block, near);

    vertex_expectations(mesh.face_offsets, mesh.corners, mesh.vertex_count(), 1 + bytes.byte());
    check_numbers(bytes);
    return 0;
}
