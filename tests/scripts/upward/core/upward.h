// Breaks the layer rule on purpose: scripts/layers has to notice (tests/CMakeLists.txt).
#include "filigree/mesh/mesh.h"
