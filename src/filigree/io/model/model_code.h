// Coded models in model files: the mesh's streams, and the driver as vertices of it.
#pragma once

#include "filigree/io/model/model_file.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/pack/mesh_code.h"
#include "filigree/strip.h"

namespace filigree {

/// The section "cd.rev": raised when streams come to mean something else.
inline constexpr std::uint32_t kCodeRevision = 2, kRevisionWithAttributes = 3; ///< the latter where levels have any

/// The section "cd.par".
struct FileCode {
    std::uint64_t vertices, faces, corners;
    std::array<double, 3> low;
    double step;
    std::uint32_t bits, surface, keep_order, unused;
    std::uint64_t driver_vertices, driver_faces, driver_corners;
};
static_assert(sizeof(FileCode) == 96);

/// What there is after level k of a stream, 0 the coarsest: entry k of the section "cd.stm". After the last level comes
/// one without batches where refinements follow, for what they make of it.
struct FileLevel {
    std::uint32_t vertices, triangles; ///< of the map, with those that close holes
    std::uint32_t batches;
    float error; ///< rms distance from the mesh's surface, model units
};
static_assert(sizeof(FileLevel) == 16);

/// The bytes of the mesh and its driver once they are read, without attributes.
double unpacked_bytes(const FileCode& code);

/// The section "cd.pose": the poses of a coded file, in blocks "cd.clip". Each begins with the driver at rest.
struct FileClip {
    std::uint32_t frames, numbers; ///< of a vertex: 3, or 12 with gradients
};
/// The bytes of the poses once they are read.
double unpacked_bytes(const FileClip& clip, const FileCode& code);

struct PackedModel {
    PackedMesh mesh;
    FileCode code{};
    std::vector<FileLevel> levels; ///< of a stream
    std::string driver;
    std::vector<Vec3f> driver_positions; ///< of a driver made elsewhere, relative to the mesh's origin; else empty
    FileClip clip{};
    double frames_per_second = 0;
    std::vector<std::string> clips; ///< blocks
    PackReport report;
};

/// Errors: as pack_model.
Result<PackedModel> code_model(const Model& model, const PoseSequence& poses, const PackOptions& options,
                               const RunContext& context);
/// Codes poses as clips: sets clip, frames_per_second, clips, and adds to report.bytes. poses: not empty. error:
/// PackOptions::clip_error.
void code_clips(const Model& model, const PoseSequence& poses, double error, PackedModel& coded);
/// All but pictures and what comes behind them: refinements, and what all of a stream needs. Each refers to `coded`,
/// which has to outlive the writer.
void write_model_code(SectionWriter& out, const PackedModel& coded);
void write_end_of_code(SectionWriter& out, const PackedModel& coded);

bool is_coded(const SectionReader& in);
/// Whether the driver of a coded file has vertices of its own (strip --driver).
bool is_made_elsewhere(const SectionReader& in);
FileCode read_file_code(const SectionReader& in);
/// The coded mesh without its streams.
PackedMesh coded_outline(const SectionReader& in, const FileCode& code);
Packing coding_of(const SectionReader& in, const FileCode& code);
/// How many poses, and whether with gradients.
FileClip clip_of(const SectionReader& in);
/// The poses; none where there are none. Throws FileDamage.
PoseSequence read_clips(const SectionReader& in);
/// rest: what of the mesh is not coded. Throws FileDamage, and Error where it is cancelled.
Model read_model_code(const SectionReader& in, Mesh rest, const RunContext& context);

} // namespace filigree
