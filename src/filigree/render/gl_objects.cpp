#include "filigree/render/gl_objects.h"

#include <stdexcept>

namespace filigree::gl {

namespace {

std::string shader_log(GLuint shader) {
    GLint length = 0;
    glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(length), '\0');
    glGetShaderInfoLog(shader, length, nullptr, log.data());
    return log;
}

std::string program_log(GLuint program) {
    GLint length = 0;
    glGetProgramiv(program, GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(length), '\0');
    glGetProgramInfoLog(program, length, nullptr, log.data());
    return log;
}

} // namespace

Program Program::link(std::span<const Stage> stages, std::span<const char* const> captured) {
    Program program;
    program.object_ = Object<ProgramTraits>::make();
    for (const Stage& stage : stages) {
        const Shader shader(glCreateShader(stage.kind));
        const char* source = stage.source.c_str();
        glShaderSource(shader.name(), 1, &source, nullptr);
        glCompileShader(shader.name());
        GLint compiled = 0;
        glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &compiled);
        if (!compiled) throw std::logic_error("a shader does not compile: " + shader_log(shader.name()));
        glAttachShader(program.name(), shader.name());
    }
    if (!captured.empty())
        glTransformFeedbackVaryings(program.name(), static_cast<GLsizei>(captured.size()), captured.data(),
                                    GL_INTERLEAVED_ATTRIBS);
    glLinkProgram(program.name());
    GLint linked = 0;
    glGetProgramiv(program.name(), GL_LINK_STATUS, &linked);
    if (!linked) throw std::logic_error("shaders do not link: " + program_log(program.name()));
    return program;
}

Result<Buffer> make_buffer(const void* data, std::size_t bytes) {
    while (glGetError() != GL_NO_ERROR) {
    }
    Buffer buffer = Buffer::make();
    glBindBuffer(GL_COPY_WRITE_BUFFER, buffer.name());
    glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
    if (glGetError() != GL_NO_ERROR)
        return Error{ErrorCode::out_of_memory, "The graphics memory has no room for " +
                                                   std::to_string(bytes / 1'000'000) +
                                                   " MB: draw a smaller mesh or a lower level."};
    return buffer;
}

bool is_software_renderer() {
    const auto* text = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string name = text ? text : "";
    return name.find("llvmpipe") != std::string::npos || name.find("softpipe") != std::string::npos ||
           name.find("SWR") != std::string::npos || name.find("Software") != std::string::npos;
}

} // namespace filigree::gl
