// The program filigree-studio.
#include "panels/panels.h"
#include "script.h"
#include "words.h"

#include <QApplication>
#include <QCommandLineParser>
#include <QOpenGLContext>
#include <QTimer>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

using namespace filigree;
using namespace filigree::studio;

namespace {

int fail(const Error& error) {
    std::fprintf(stderr, "filigree-studio: %s\n", error.message.c_str());
    return static_cast<int>(error.code);
}

Result<QSize> parse_size(const QString& text) {
    const QStringList sides = text.split('x');
    bool width_ok = false, height_ok = false;
    const QSize size = sides.size() == 2 ? QSize(sides[0].toInt(&width_ok), sides[1].toInt(&height_ok)) : QSize();
    if (width_ok && height_ok && size.width() >= 320 && size.height() >= 240 && size.width() <= 8192 &&
        size.height() <= 8192)
        return size;
    return Error{ErrorCode::usage, "--size: '" + text.toStdString() +
                                       "' is no size; write width and height in pixels, from 320x240 to 8192x8192, "
                                       "such as 1280x800."};
}

Result<unsigned> parse_frames(const QString& text) {
    bool ok = false;
    const unsigned frames = text.toUInt(&ok);
    if (ok && frames <= 100'000) return frames;
    return Error{ErrorCode::usage,
                 "--frames: '" + text.toStdString() + "' is no number of frames; write one from 0 to 100000."};
}

/// "model, quads, ... and view".
QString panel_names() { return listed({kPanels.begin(), kPanels.end()}); }

struct Options {
    QString file, screenshot, panel, script;
    QSize size = {1280, 800};
    unsigned frames = 0;
    bool sizes = false; ///< --size was given
    bool names = false;
    bool leaves() const { return !screenshot.isEmpty() || !script.isEmpty() || names; }
};

Result<Options> parse(const QApplication& application) {
    QCommandLineParser parser;
    parser.setApplicationDescription("Opens a mesh or a model, lets you pull it, and puts the detail back.");
    const QCommandLineOption help = parser.addHelpOption();
    parser.addVersionOption();
    parser.addPositionalArgument("file", "A mesh or a model (.fil).", "[FILE]");
    parser.addOptions({
        {"screenshot", "Show the window, save it as a PNG, leave.", "PNG"},
        {"size", "Size of the window, pixels.", "WxH"},
        {"panel", "Open with this panel: " + panel_names().replace(" and ", " or ") + '.', "NAME"},
        {"frames", "Simulate so many frames first.", "N"},
        {"names", "Print what scripts can name, leave."},
        {"script", "Run a script of actions (docs/studio.md), leave.", "FILE"},
    });
    parser.process(application);
    Options options;
    if (parser.positionalArguments().size() > 1)
        return Error{ErrorCode::usage, "One file at a time; several were named."};
    options.file = parser.positionalArguments().value(0);
    options.screenshot = parser.value("screenshot");
    options.panel = parser.value("panel");
    options.script = parser.value("script");
    options.names = parser.isSet("names");
    if (parser.isSet("size")) {
        Result<QSize> size = parse_size(parser.value("size"));
        if (!size) return size.error();
        options.size = *size;
        options.sizes = true;
    }
    if (parser.isSet("frames")) {
        Result<unsigned> frames = parse_frames(parser.value("frames"));
        if (!frames) return frames.error();
        options.frames = *frames;
    }
    return options;
}

/// What a run that shows, saves and leaves does once the window is there.
Status run_alone(const Options& options, ErrorWatch& watch, MainWindow& window) {
    constexpr double kPatience = 600; // seconds, for the largest meshes on the software renderer
    if (!wait_until_still(window, kPatience))
        return Error{ErrorCode::unsuitable, "The window was not still after ten minutes; nothing was saved."};
    if (Status opened = watch.take(); !opened) return opened;
    if (options.frames > 0)
        if (Status simulated = simulate_frames(options.frames, window); !simulated) return simulated;
    if (!options.script.isEmpty())
        if (Status ran = run_script(options.script.toStdString(), window); !ran) return ran;
    if (!options.screenshot.isEmpty()) return save_screenshot(options.screenshot.toStdString(), window);
    return Success{};
}

/// Qt's words on stderr, in our way; its last ones, before it would abort, as a sentence with an exit code.
void hear_qt(QtMsgType type, const QMessageLogContext& context, const QString& text) {
    if (type == QtFatalMsg) {
        std::fprintf(stderr, "filigree-studio: There is no screen to show a window on; start it on a desktop, or under "
                             "xvfb-run -a -s \"-screen 0 1600x1200x24\".\n");
        std::_Exit(static_cast<int>(ErrorCode::unsupported));
    }
    const bool is_about_the_desktop =
        QLatin1String(context.category).startsWith(QLatin1String("qt.qpa")) || text.contains("XDG_RUNTIME_DIR");
    if ((type == QtWarningMsg || type == QtCriticalMsg) && !is_about_the_desktop)
        std::fprintf(stderr, "filigree-studio: %s\n", qPrintable(text));
}

/// Words alone need no screen.
bool asks_for_words(int argc, char** argv) {
    return std::any_of(argv + 1, argv + argc, [](const std::string_view word) {
        return word == "-h" || word == "--help" || word == "--help-all" || word == "-v" || word == "--version";
    });
}

/// Qt 6.4 crashes in a window whose OpenGL is not there, so that is found out before.
Status check_opengl() {
    QOpenGLContext context;
    if (context.create()) return Success{};
    return Error{ErrorCode::unsupported, "This screen ('" + QGuiApplication::platformName().toStdString() +
                                             "') has no OpenGL; install a graphics driver (apt-get install "
                                             "libgl1-mesa-dri), or start on an X display."};
}

} // namespace

int main(int argc, char** argv) {
    qInstallMessageHandler(hear_qt);
    if (asks_for_words(argc, argv)) qputenv("QT_QPA_PLATFORM", "offscreen");
    prepare_application();
    QApplication application(argc, argv);
    const Result<Options> options = parse(application);
    if (!options) return fail(options.error());
    if (const Status able = check_opengl(); !able) return fail(able.error());

    MainWindow window(!options->leaves());
    if (options->leaves() || options->sizes) window.resize(options->size);
    if (!options->panel.isEmpty() && !window.show_panel(options->panel))
        return fail({ErrorCode::usage, "--panel: there is no panel '" + options->panel.toStdString() + "'; there are " +
                                           panel_names().toStdString() + '.'});
    if (options->names) {
        std::fputs(script_names(window).c_str(), stdout);
        return 0;
    }
    window.show();
    ErrorWatch watch(window.workbench());
    if (!options->file.isEmpty()) window.open_file(options->file);
    if (!options->leaves()) return QApplication::exec();

    Status status = Success{};
    QTimer::singleShot(0, &window, [&] {
        status = run_alone(*options, watch, window);
        QApplication::exit();
    });
    QApplication::exec();
    return status ? 0 : fail(status.error());
}
