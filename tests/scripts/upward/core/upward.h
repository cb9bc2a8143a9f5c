// Breaks the layer rule on purpose: scripts/layers has to notice (tests/CMakeLists.txt).
#include "filigree/mesh.h"

inline const char* words_of_the_program() { return "too coarse; strip with --base 100"; }
