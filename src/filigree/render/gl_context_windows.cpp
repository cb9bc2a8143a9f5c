// OpenGL without a visible window. Windows gives a context to windows alone: this one is never shown.
#if defined(_WIN32)

#include "filigree/render.h"

#include "filigree/io/system/windows_calls.h"

#include <epoxy/gl.h>

#include <array>

namespace filigree {

namespace {

Error no_opengl(const std::string& reason) {
    return {ErrorCode::unsupported,
            "No OpenGL 4.3 was found (" + reason + "); install the driver of the graphics card's maker."};
}

// Windows' own functions are called here. epoxy's keep a table for each context, and do that only in a DLL: linked
// statically they crash with the second context.
using CreateContext = HGLRC(WINAPI*)(HDC, HGLRC, const int*); // of WGL_ARB_create_context
constexpr int kMajorVersion = 0x2091, kMinorVersion = 0x2092, kProfiles = 0x9126, kCoreProfile = 1;
constexpr std::array<int, 7> kWanted = {kMajorVersion, 4, kMinorVersion, 3, kProfiles, kCoreProfile, 0};
constexpr wchar_t kWindowClass[] = L"filigree";

} // namespace

struct HeadlessContext::Content {
    HWND window = nullptr;
    HDC device = nullptr;
    HGLRC context = nullptr;
    std::string name;

    ~Content() {
        wglMakeCurrent(nullptr, nullptr);
        if (context) wglDeleteContext(context);
        if (device) ReleaseDC(window, device);
        if (window) DestroyWindow(window);
    }

    /// Empty, or what Windows did not do.
    std::string open() {
        WNDCLASSW kind{};
        kind.style = CS_OWNDC;
        kind.lpfnWndProc = DefWindowProcW;
        kind.hInstance = GetModuleHandleW(nullptr);
        kind.lpszClassName = kWindowClass;
        RegisterClassW(&kind); // the second time it is there already
        window = CreateWindowW(kWindowClass, L"", WS_OVERLAPPEDWINDOW, 0, 0, 16, 16, nullptr, nullptr, kind.hInstance,
                               nullptr);
        if (!window) return "there is no desktop to make a window on";
        device = GetDC(window);
        PIXELFORMATDESCRIPTOR format{};
        format.nSize = sizeof format;
        format.nVersion = 1;
        format.dwFlags = PFD_DRAW_TO_WINDOW | PFD_SUPPORT_OPENGL;
        format.iPixelType = PFD_TYPE_RGBA;
        format.cColorBits = 32;
        if (!SetPixelFormat(device, ChoosePixelFormat(device, &format), &format)) return "windows have no OpenGL";
        // The version is asked for by a function that only a context of some version has.
        const HGLRC first = wglCreateContext(device);
        if (!first || !wglMakeCurrent(device, first)) return "windows have no OpenGL";
        const PROC function = wglGetProcAddress("wglCreateContextAttribsARB");
        if (function)
            context =
                reinterpret_cast<CreateContext>(reinterpret_cast<void*>(function))(device, nullptr, kWanted.data());
        wglMakeCurrent(nullptr, nullptr);
        wglDeleteContext(first);
        if (!context || !wglMakeCurrent(device, context)) return "the driver is older";
        return {};
    }
};

HeadlessContext::HeadlessContext(std::unique_ptr<Content> content) : content_(std::move(content)) {}
HeadlessContext::HeadlessContext(HeadlessContext&&) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&&) noexcept = default;
HeadlessContext::~HeadlessContext() = default;

const std::string& HeadlessContext::renderer_name() const { return content_->name; }

Result<HeadlessContext> HeadlessContext::create() {
    auto content = std::make_unique<Content>();
    if (const std::string reason = content->open(); !reason.empty()) return no_opengl(reason);
    content->name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    return HeadlessContext(std::move(content));
}

} // namespace filigree

#endif
