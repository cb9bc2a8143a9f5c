// OpenGL objects that give themselves back. Only for this layer's own sources: everything else need not know OpenGL.
#pragma once

#include "filigree/result.h"

#include <epoxy/gl.h>

#include <span>
#include <string>
#include <utility>

namespace filigree::gl {

/// Owns one OpenGL name; Traits has `static GLuint make()` and `static void free(GLuint)`.
template <class Traits>
class Object {
public:
    Object() = default;
    static Object make() {
        Object object;
        object.name_ = Traits::make();
        return object;
    }
    explicit Object(GLuint name) : name_(name) {}
    Object(Object&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
    Object& operator=(Object&& other) noexcept {
        std::swap(name_, other.name_);
        return *this;
    }
    ~Object() {
        if (name_) Traits::free(name_);
    }
    GLuint name() const { return name_; }
    explicit operator bool() const { return name_ != 0; }

private:
    GLuint name_ = 0;
};

/// Of names that OpenGL gives out and takes back by the number; epoxy has its functions as variables.
template <auto* kMake, auto* kFree>
struct NumberedTraits {
    static GLuint make() {
        GLuint name = 0;
        (*kMake)(1, &name);
        return name;
    }
    static void free(GLuint name) { (*kFree)(1, &name); }
};
struct ProgramTraits {
    static GLuint make() { return glCreateProgram(); }
    static void free(GLuint name) { glDeleteProgram(name); }
};
struct ShaderTraits {
    static GLuint make() { return 0; }
    static void free(GLuint name) { glDeleteShader(name); }
};

using Buffer = Object<NumberedTraits<&glGenBuffers, &glDeleteBuffers>>;
using Texture = Object<NumberedTraits<&glGenTextures, &glDeleteTextures>>;
using Sampler = Object<NumberedTraits<&glGenSamplers, &glDeleteSamplers>>;
using Framebuffer = Object<NumberedTraits<&glGenFramebuffers, &glDeleteFramebuffers>>;
using Renderbuffer = Object<NumberedTraits<&glGenRenderbuffers, &glDeleteRenderbuffers>>;
using VertexArray = Object<NumberedTraits<&glGenVertexArrays, &glDeleteVertexArrays>>;
using Shader = Object<ShaderTraits>;

/// A linked program; uniforms by name.
class Program {
public:
    Program() = default;
    /// One stage of a program: its kind (GL_VERTEX_SHADER ...) and its source.
    struct Stage {
        GLenum kind;
        std::string source;
    };
    /// captured: names of outputs to record by transform feedback, interleaved. A source that does not compile is a
    /// mistake of ours, thrown as std::logic_error with the driver's log.
    static Program link(std::span<const Stage> stages, std::span<const char* const> captured = {});

    GLuint name() const { return object_.name(); }
    explicit operator bool() const { return static_cast<bool>(object_); }
    /// The place of a uniform; -1 (which OpenGL ignores) when the program does not use it.
    GLint uniform(const char* uniform_name) const { return glGetUniformLocation(name(), uniform_name); }

private:
    Object<ProgramTraits> object_;
};

/// Whether the processor draws: several samples a pixel are several times the work then, and so is every vertex.
bool is_software_renderer();

/// A buffer filled with `values` (once; GL_STATIC_DRAW), or out_of_memory where the GPU does not take that many bytes.
Result<Buffer> make_buffer(const void* data, std::size_t bytes);
template <class T>
Result<Buffer> make_buffer(std::span<const T> values) {
    return make_buffer(values.data(), values.size_bytes());
}

} // namespace filigree::gl
