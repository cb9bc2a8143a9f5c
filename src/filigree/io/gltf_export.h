// Models and animations as GLB for other programs, in three ways.
#pragma once

#include "filigree/io/gltf_levels_export.h"
#include "filigree/io/gltf_morph_export.h"
#include "filigree/io/gltf_skin_export.h"
