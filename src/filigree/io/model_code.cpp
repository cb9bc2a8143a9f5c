#include "filigree/io/model_code.h"

#include "filigree/coding/face_code.h"
#include "filigree/hierarchy/strip.h"
#include "filigree/hierarchy/vertex_order.h"

#include <bit>

namespace filigree {

namespace {

/// Bits that name one of `count`.
unsigned bits_to_name(std::size_t count) { return count > 1 ? unsigned(std::bit_width(count - 1)) : 0; }

/// The driver's faces; which of its vertices each number is; which vertex of the coded mesh each of its vertices is.
std::string code_driver(const Level& driver, std::span<const Index> place_in_code) {
    SymbolWriter out(kFaceContexts);
    const std::size_t count = driver.vertices.size();
    const EncodedFaces faces = encode_faces(driver.face_offsets, driver.corners, count, out);
    for (const Index i : faces.vertex) out.bits(i, bits_to_name(count));
    for (const Index v : driver.vertices) out.bits(place_in_code[v], bits_to_name(place_in_code.size()));
    return out.finish();
}

Level decode_driver(std::string_view stream, const FileCode& code) {
    const FileDamage damage{"has a damaged driver"};
    SymbolReader in(stream, kFaceContexts);
    std::optional<WalkedFaces> faces = decode_faces(in, code.driver_vertices, code.driver_corners);
    if (!faces || faces->face_offsets.size() != code.driver_faces + 1) throw damage;
    Level driver;
    std::vector<Index> vertex_of(code.driver_vertices); // of each number
    for (Index& i : vertex_of) {
        i = in.bits(bits_to_name(code.driver_vertices));
        if (i >= code.driver_vertices || in.is_damaged()) throw damage;
    }
    driver.face_offsets = std::move(faces->face_offsets);
    for (const Index c : faces->corners) driver.corners.push_back(vertex_of[c]);
    std::vector<bool> is_used(code.vertices);
    for (std::size_t i = 0; i < code.driver_vertices; ++i) {
        const Index v = in.bits(bits_to_name(code.vertices));
        if (v >= code.vertices || is_used[v] || in.is_damaged()) throw damage;
        is_used[v] = true;
        driver.vertices.push_back(v);
    }
    return driver;
}

/// The driver's vertices first and in their order, so that they ascend; then the others.
Mesh with_driver_first(Mesh mesh, Level& driver, const RunContext& context) {
    std::vector<bool> is_driver(mesh.vertex_count());
    for (const Index v : driver.vertices) is_driver[v] = true;
    std::vector<Index> order = driver.vertices;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (!is_driver[v]) order.push_back(v);
    for (Index i = 0; i < driver.vertices.size(); ++i) driver.vertices[i] = i;
    return with_vertex_order(std::move(mesh), order, context);
}

/// Whether the mesh's faces use none of the driver's vertices, though there are faces in both.
bool is_made_elsewhere(const Model& model) {
    if (model.mesh.face_count() == 0 || model.driver().face_count() == 0) return false;
    std::vector<bool> is_used(model.mesh.vertex_count());
    for (const Index v : model.mesh.corners) is_used[v] = true;
    return std::ranges::none_of(model.driver().vertices, [&](Index v) { return is_used[v]; });
}

std::string stream_of(const SectionReader& in, std::string_view name) {
    const std::vector<char> bytes = in.array<char>(name);
    return {bytes.begin(), bytes.end()};
}

} // namespace

Result<CodedModel> code_model(const Model& model, const MeshCodeOptions& options, const RunContext& context) {
    const auto* detail = std::get_if<BlendDetail>(&model.detail);
    if (!detail)
        return Error{ErrorCode::unsuitable,
                     "The model has the reference code, which is not packed; strip the mesh with the blend code."};
    if (is_made_elsewhere(model))
        return Error{ErrorCode::unsuitable,
                     "The model's driver was made elsewhere (strip --driver), and such models are not packed."};
    CodedModel coded;
    MeshCodeReport report;
    Result<CodedMesh> mesh = encode_mesh(model.mesh, options, &report, context);
    if (!mesh) return mesh.error();
    coded.mesh = std::move(*mesh);
    const Level& driver = model.driver();
    std::vector<Index> place(model.mesh.vertex_count());
    for (Index i = 0; i < place.size(); ++i) place[options.keep_order ? i : report.vertex[i]] = i;
    coded.driver = code_driver(driver, place);
    coded.code = {.vertices = coded.mesh.vertices,
                  .faces = coded.mesh.faces,
                  .corners = coded.mesh.corners,
                  .low = coded.mesh.low,
                  .step = coded.mesh.step,
                  .bits = options.bits,
                  .surface = options.surface,
                  .keep_order = options.keep_order,
                  .precision = static_cast<std::uint32_t>(detail->precision),
                  .driver_vertices = driver.vertices.size(),
                  .driver_faces = driver.face_count(),
                  .driver_corners = driver.corners.size()};
    coded.report = {.rms = report.rms,
                    .largest = report.largest,
                    .bytes = {coded.mesh.connectivity.size(), coded.mesh.places.size(), coded.mesh.attributes.size(),
                              coded.mesh.order.size(), coded.driver.size()}};
    return coded;
}

void write_model_code(SectionWriter& out, const CodedModel& coded) {
    out.value("cd.par", coded.code);
    out.bytes("cd.drv", coded.driver, 0);
    out.bytes("cd.con", coded.mesh.connectivity, 0);
    out.bytes("cd.pos", coded.mesh.places, 0);
    out.bytes("cd.att", coded.mesh.attributes, 0);
    if (!coded.mesh.order.empty()) out.bytes("cd.ord", coded.mesh.order, 0);
}

bool is_coded(const SectionReader& in) { return in.count("cd.par").first > 0; }

FileCode read_file_code(const SectionReader& in) {
    const auto code = in.value<FileCode>("cd.par");
    if (code.precision > 1 || code.bits > 16 || code.driver_vertices == 0 || code.driver_vertices > code.vertices ||
        code.vertices >= kNoIndex)
        throw FileDamage{"has coded parts that make no sense"};
    return code;
}

Coding coding_of(const SectionReader& in, const FileCode& code) {
    return {.options = {code.bits, code.surface != 0, code.keep_order != 0},
            .step = code.step,
            .bytes = {in.item_count<char>("cd.con"), in.item_count<char>("cd.pos"), in.item_count<char>("cd.att"),
                      in.item_count<char>("cd.ord"), in.item_count<char>("cd.drv")}};
}

Model read_model_code(const SectionReader& in, Mesh rest, const RunContext& context) {
    const FileCode code = read_file_code(in);
    CodedMesh coded{.vertices = code.vertices,
                    .faces = code.faces,
                    .corners = code.corners,
                    .low = code.low,
                    .step = code.step,
                    .options = {code.bits, code.surface != 0, code.keep_order != 0},
                    .connectivity = stream_of(in, "cd.con"),
                    .places = stream_of(in, "cd.pos"),
                    .attributes = stream_of(in, "cd.att"),
                    .order = stream_of(in, "cd.ord"),
                    .rest = std::move(rest)};
    Result<Mesh> mesh = decode_mesh(coded, context);
    if (!mesh && mesh.error().code == ErrorCode::cancelled) throw mesh.error();
    if (!mesh) throw FileDamage{"holds a coded mesh that is damaged", "pack it again"};
    Level driver = decode_driver(stream_of(in, "cd.drv"), code);
    if (code.keep_order && !std::ranges::is_sorted(driver.vertices)) throw FileDamage{"has a damaged driver"};
    if (!code.keep_order) *mesh = with_driver_first(std::move(*mesh), driver, context);
    Result<Model> model =
        bind_to_own_driver(std::move(*mesh), std::move(driver), static_cast<Precision>(code.precision), context);
    if (!model) throw model.error();
    return std::move(*model);
}

} // namespace filigree
