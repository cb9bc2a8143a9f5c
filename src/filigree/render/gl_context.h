// OpenGL without a window.
#pragma once

#include "filigree/core/result.h"

#include <memory>
#include <string>

namespace filigree {

/// An OpenGL 4.3 core context through EGL: on a GPU where there is one, else on Mesa's software renderer. Needs no
/// display and no rights. Drawing happens in the thread that made the context current.
class HeadlessContext {
public:
    /// Makes a context and makes it current in this thread.
    /// Errors: unsupported (no EGL or no OpenGL 4.3: says what to install), out_of_memory (too little address space).
    static Result<HeadlessContext> create();
    HeadlessContext(HeadlessContext&&) noexcept;
    HeadlessContext& operator=(HeadlessContext&&) noexcept;
    ~HeadlessContext();

    /// What draws, as OpenGL names itself: "llvmpipe (LLVM 15.0.6, 256 bits)".
    const std::string& renderer_name() const;

private:
    struct Content;
    explicit HeadlessContext(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
