// Coded models in model files: the mesh's streams, and the driver as vertices of it.
#pragma once

#include "filigree/coding/mesh_code.h"
#include "filigree/hierarchy/model.h"
#include "filigree/io/model_file.h"
#include "filigree/io/model_sections.h"

namespace filigree {

/// The section "cd.par".
struct FileCode {
    std::uint64_t vertices, faces, corners;
    std::array<double, 3> low;
    double step;
    std::uint32_t bits, surface, keep_order, precision;
    std::uint64_t driver_vertices, driver_faces, driver_corners;
};
static_assert(sizeof(FileCode) == 96);

struct CodedModel {
    CodedMesh mesh;
    FileCode code{};
    std::string driver;
    CodingReport report;
};

/// Errors: as write_coded_model.
Result<CodedModel> code_model(const Model& model, const MeshCodeOptions& options, const RunContext& context);
/// Refers to `coded`, which has to outlive the writer.
void write_model_code(SectionWriter& out, const CodedModel& coded);

bool is_coded(const SectionReader& in);
FileCode read_file_code(const SectionReader& in);
Coding coding_of(const SectionReader& in, const FileCode& code);
/// rest: what of the mesh is not coded. Throws FileDamage, and Error where it is cancelled.
Model read_model_code(const SectionReader& in, Mesh rest, const RunContext& context);

} // namespace filigree
