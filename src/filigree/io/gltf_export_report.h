// What the exports of animations as GLB have in common: the choice of normals, and what they say about the file.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace filigree {

enum class ExportNormals {
    keep,  ///< the mesh's own; computed from its faces where it has none
    leave, ///< none: viewers shade flat, which stays right under stretch
};

struct ExportReport {
    std::size_t bytes = 0, vertices = 0, joints = 0, keys = 0;
    double seconds = 0; ///< of the animation
    /// Largest and RMS distance of the file, evaluated as a viewer would, from our own restore, as fractions of the
    /// diagonal at the first key: at keys, and between them (at the poses' own frames where keys are sparser; else
    /// half way, against the restore of the driver half way).
    double error_at_keys = 0, error_between_keys = 0;
    double rms_at_keys = 0, rms_between_keys = 0;
    std::size_t moments = 0;         ///< keys, and moments between them
    std::size_t moments_checked = 0; ///< of these, how many were evaluated: all, unless there are very many
    /// 95th percentile, over driver vertices and keys, of how far normals may be off, in degrees, in viewers that turn
    /// them with the skin matrix (three.js, Babylon.js): atan r - atan(1/r) of the stretch ratio r.
    double normal_error_degrees = 0;
    std::vector<std::string> warnings;
};

} // namespace filigree
