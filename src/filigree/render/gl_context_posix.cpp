// OpenGL without a window, by EGL. Of Windows: gl_context_windows.cpp.
#if !defined(_WIN32)

#include "filigree/render.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <sys/mman.h>

#include <array>
#include <vector>

namespace filigree {

namespace {

Error no_opengl(const std::string& reason) {
    return {ErrorCode::unsupported,
            "No OpenGL 4.3 was found (" + reason +
                "); install a driver, or Mesa's software renderer: apt-get install libegl1 libgl1-mesa-dri."};
}

/// epoxy leaves the program when a library it needs is not there, so that is asked first.
bool can_load(const char* library) {
    void* handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    if (handle) dlclose(handle);
    return handle != nullptr;
}

constexpr std::array<EGLint, 7> kWanted = {
    EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};

/// Displays to try, best first: the devices EGL knows (GPUs), then Mesa without any surface.
std::vector<EGLDisplay> displays() {
    std::vector<EGLDisplay> found;
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") &&
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration")) {
        std::array<EGLDeviceEXT, 16> devices;
        EGLint count = 0;
        if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count))
            for (EGLint i = 0; i < count; ++i)
                found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
    }
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
        found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    return found;
}

} // namespace

struct HeadlessContext::Content {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    std::string name;

    ~Content() {
        if (display == EGL_NO_DISPLAY) return;
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
        eglTerminate(display);
    }

    bool open(EGLDisplay candidate) {
        EGLint major = 0, minor = 0;
        if (candidate == EGL_NO_DISPLAY || !eglInitialize(candidate, &major, &minor)) return false;
        display = candidate;
        if (!eglBindAPI(EGL_OPENGL_API)) return false;
        context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kWanted.data());
        return context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context);
    }
};

HeadlessContext::HeadlessContext(std::unique_ptr<Content> content) : content_(std::move(content)) {}
HeadlessContext::HeadlessContext(HeadlessContext&&) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&&) noexcept = default;
HeadlessContext::~HeadlessContext() = default;

const std::string& HeadlessContext::renderer_name() const { return content_->name; }

namespace {

/// Whether as many bytes of address space are to be had; nothing is taken.
bool has_room(std::size_t bytes) {
    void* place = ::mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (place == MAP_FAILED) return false;
    ::munmap(place, bytes);
    return true;
}

} // namespace

Result<HeadlessContext> HeadlessContext::create() {
    if (!can_load("libEGL.so.1")) return no_opengl("libEGL.so.1 is not installed");
    if (!can_load("libGL.so.1") && !can_load("libOpenGL.so.0")) return no_opengl("libOpenGL.so.0 is not installed");
    constexpr std::size_t kDriverRoom = std::size_t{576} << 20; // with less Mesa crashes while it compiles shaders
    if (!has_room(kDriverRoom))
        return Error{ErrorCode::out_of_memory, "There is too little address space for OpenGL; allow more (ulimit -v)."};
    for (EGLDisplay display : displays()) {
        auto content = std::make_unique<Content>();
        if (!content->open(display)) continue;
        content->name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
        return HeadlessContext(std::move(content));
    }
    return no_opengl("no EGL display offers it");
}

} // namespace filigree

#endif
