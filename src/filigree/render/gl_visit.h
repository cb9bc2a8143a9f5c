// Drawing in a context that others draw in too (Qt's painter). Only for this layer's own sources.
#pragma once

#include "filigree/render/gl_objects.h"

namespace filigree::gl {

/// Sets everything that drawing depends on, and leaves nothing of ours behind that others trip over: no program,
/// arrays, textures or tests; and the framebuffer that was bound before.
class Visit {
public:
    Visit();
    explicit Visit(GLuint leave_bound);
    Visit(const Visit&) = delete;
    ~Visit();

private:
    GLuint framebuffer_ = 0;
};

} // namespace filigree::gl
