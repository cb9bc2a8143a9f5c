// What all model files have in common: a mesh and its levels as sections.
#pragma once

#include "filigree/io/file.h"
#include "filigree/io/model_file.h"
#include "filigree/io/model_sections.h"
#include "filigree/strip.h"

#include <new>
#include <stdexcept>

namespace filigree {

/// Values of the section "code": how detail is stored.
inline constexpr std::uint32_t kReferenceCode = 0, kBlendCode = 1;
/// Whether detail is the report's. Throws FileDamage where the code is not known, or nothing of it is there.
inline bool has_reference_code(const SectionReader& in) {
    const auto code = in.value<std::uint32_t>("code");
    if (code > kBlendCode) throw FileDamage{"has a detail code that is not known"};
    if (code == kReferenceCode) (void)in.value<std::array<std::uint32_t, 2>>("rf.par");
    return code == kReferenceCode;
}

/// A mesh; positions are left out where the detail's records hold them, pictures where they come later.
void write_mesh_sections(SectionWriter& out, const Mesh& mesh, bool with_positions, bool with_pictures = true);
void write_pictures(SectionWriter& out, const std::vector<MeshMaterial>& materials);
/// Not checked. Throws FileDamage.
Mesh read_mesh_sections(const SectionReader& in);
/// The materials inside a file; pictures can be left out, as where they have not come yet. Throws FileDamage.
std::vector<MeshMaterial> read_embedded_materials(const SectionReader& in, const std::vector<std::string>& names,
                                                  bool with_pictures);

void write_level_sections(SectionWriter& out, const std::vector<Level>& levels);
/// Not checked. Throws FileDamage.
std::vector<Level> read_level_sections(const SectionReader& in);
/// Faces of a mesh or of level `index`. Throws FileDamage.
void read_faces(const SectionReader& in, const std::string& name, std::uint32_t index, std::vector<Index>& offsets,
                std::vector<Index>& corners);

/// What `read` makes of a file; what it throws as an Error.
template <class Read>
auto read_guarded(const FileReader& file, const std::string& name, const RunContext& context, const Read& read)
    -> Result<decltype(read(file))> {
    if (context.is_cancelled()) return cancelled_error();
    try {
        if (!is_model_file(file))
            return Error{ErrorCode::bad_file, name + " is not a Filigree model: strip a mesh to make one."};
        return read(file);
    } catch (const Error& error) {
        return error;
    } catch (const FileDamage& damage) {
        return error_of(damage, name);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, name + " does not fit into memory."};
    } catch (const std::length_error&) {
        return Error{ErrorCode::out_of_memory, name + " does not fit into memory."};
    }
}

} // namespace filigree
