#include "filigree/io/reference_file.h"

#include "filigree/io/file.h"
#include "filigree/io/mesh_sections.h"
#include "filigree/io/model_code.h"

namespace filigree {

namespace {

void write_reference_sections(SectionWriter& out, const ReferenceModel& model) {
    const ReferenceDetail& detail = model.detail;
    write_mesh_sections(out, model.mesh, true);
    out.value("code", kReferenceCode);
    write_level_sections(out, model.levels);
    out.value("rf.par", std::array<std::uint32_t, 2>{detail.patches.levels, detail.references});
    out.value("rf.ext", detail.extent);
    out.array("rf.base", detail.patches.base);
    out.array("rf.grid", detail.patches.grid);
    out.array("rf.drv", detail.rest_driver);
    out.array("rf.rec", detail.records);
    out.array("rf.loose", detail.loose);
}

ReferenceModel read_reference_sections(const FileReader& file, const std::string& name) {
    const SectionReader in(file);
    if (is_coded(in) || !has_reference_code(in))
        throw Error{ErrorCode::unsuitable, name + ": has the blend code and not the report's reference code."};
    ReferenceModel model{.mesh = read_mesh_sections(in), .levels = read_level_sections(in), .detail = {}};
    if (in.value<std::uint64_t>("mesh.num") != model.mesh.vertex_count())
        throw FileDamage{"does not have as many positions as it says"};
    ReferenceDetail& detail = model.detail;
    const auto parameters = in.value<std::array<std::uint32_t, 2>>("rf.par");
    detail.patches.levels = parameters[0];
    detail.references = parameters[1];
    detail.extent = in.value<float>("rf.ext");
    detail.patches.base = in.array<std::array<Index, 4>>("rf.base");
    detail.patches.grid = in.array<Index>("rf.grid");
    detail.rest_driver = in.array<Vec3f>("rf.drv");
    detail.records = in.array<Vec3f>("rf.rec");
    detail.loose = in.array<Index>("rf.loose");
    if (const std::string wrong = check_model(model); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
    return model;
}

} // namespace

Result<ReferenceModel> read_reference_model(const FileReader& file, const std::string& name,
                                            const RunContext& context) {
    context.report("read", 0);
    Result<ReferenceModel> model =
        read_guarded(file, name, context, [&](const FileReader& from) { return read_reference_sections(from, name); });
    context.report("read", 1);
    return model;
}

Result<ReferenceModel> read_reference_model(const std::filesystem::path& path, const RunContext& context) {
    const Result<FileReader> file = FileReader::open(path);
    if (!file) return file.error();
    return read_reference_model(*file, path.string(), context);
}

std::string write_reference_model(const ReferenceModel& model) {
    SectionWriter out;
    write_reference_sections(out, model);
    std::string file;
    for (const std::string_view piece : out.finish()) file += piece;
    return file;
}

Status write_reference_model(const ReferenceModel& model, const std::filesystem::path& path,
                             const RunContext& context) {
    if (context.is_cancelled()) return cancelled_error();
    context.report("write", 0);
    try {
        SectionWriter out;
        write_reference_sections(out, model);
        Status status = write_file(path, out.finish());
        context.report("write", 1);
        return status;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": not enough memory for the file's bytes."};
    }
}

} // namespace filigree
