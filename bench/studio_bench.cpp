// What someone at the studio waits for: the first picture, a mesh that opens, pictures while it is pulled. Needs a
// screen; without one:
//   xvfb-run -a -s "-screen 0 1600x1200x24" build/release/bin/studio_bench MESH
#include "script.h"

#include "filigree/types.h"

#include <QApplication>
#include <QElapsedTimer>
#include <QFile>
#include <QMouseEvent>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include <unistd.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

using Clock = std::chrono::steady_clock;

const Clock::time_point kLoaded = Clock::now(); // used where /proc does not tell

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// Since this process was started, libraries and all; to a hundredth of a second on Linux.
double seconds_since_start() {
    QFile stat("/proc/self/stat"), uptime("/proc/uptime");
    if (!stat.open(QFile::ReadOnly) || !uptime.open(QFile::ReadOnly)) return seconds_since(kLoaded);
    const QByteArray line = stat.readAll();
    const QList<QByteArray> fields = line.mid(line.lastIndexOf(')') + 2).split(' '); // from the third on
    constexpr int kStartTime = 22 - 3;
    if (fields.size() <= kStartTime) return seconds_since(kLoaded);
    const double started = fields[kStartTime].toDouble() / double(sysconf(_SC_CLK_TCK));
    return uptime.readAll().split(' ')[0].toDouble() - started;
}

struct Values {
    std::vector<double> values;
    double quantile(double part) {
        if (values.empty()) return 0;
        std::sort(values.begin(), values.end());
        return values[static_cast<std::size_t>(part * double(values.size() - 1))];
    }
    void print(const char* name) {
        std::printf("  %-8s median %6.1f ms, p95 %6.1f ms\n", name, quantile(0.5), quantile(0.95));
    }
};

void send(Viewport& viewport, QEvent::Type type, const QPointF& at, Qt::MouseButton button, Qt::MouseButtons buttons) {
    QMouseEvent event(type, at, viewport.mapToGlobal(at), button, buttons, {});
    QApplication::sendEvent(&viewport, &event);
}

/// A place of the picture, near the middle, where the shape is.
std::optional<QPointF> place_to_grab(Viewport& viewport) {
    const QPointF middle = viewport.rect().center();
    for (double radius = 0; radius < 200; radius += 20)
        for (int k = 0; k < 8; ++k) {
            const double angle = k * std::acos(-1.0) / 4;
            const QPointF at = middle + radius * QPointF(std::cos(angle), std::sin(angle));
            if (viewport.pick(at)) return at;
        }
    return std::nullopt;
}

/// Takes hold of the shape and moves the mouse in circles for four seconds.
void pull(MainWindow& window, const char* what) {
    constexpr double kSeconds = 4;
    Viewport& viewport = window.viewport();
    const std::optional<QPointF> from = place_to_grab(viewport);
    if (!from) return void(std::printf("%s: there is nothing to grab\n", what));
    Values driver, restore, draw;
    std::vector<unsigned> levels;
    QObject watcher;
    QObject::connect(&viewport, &Viewport::timings_changed, &watcher, [&] {
        const Timings& t = viewport.timings();
        driver.values.push_back(t.driver);
        restore.values.push_back(t.restore);
        draw.values.push_back(t.draw);
        levels.push_back(t.level);
    });
    send(viewport, QEvent::MouseButtonPress, *from, Qt::LeftButton, Qt::LeftButton);
    const Clock::time_point begin = Clock::now();
    while (seconds_since(begin) < kSeconds) {
        const double angle = 3 * seconds_since(begin);
        const QPointF at = *from + 60 * QPointF(1 - std::cos(angle), std::sin(angle));
        send(viewport, QEvent::MouseMove, at, Qt::NoButton, Qt::LeftButton);
        QApplication::processEvents(QEventLoop::AllEvents, 4);
    }
    const double seconds = seconds_since(begin);
    send(viewport, QEvent::MouseButtonRelease, *from, Qt::LeftButton, Qt::NoButton);
    std::sort(levels.begin(), levels.end());
    std::printf("%s: %.1f pictures a second, level %u of %u\n", what, double(levels.size()) / seconds,
                levels.empty() ? 0 : levels[levels.size() / 2], window.workbench().state().model->finest_level());
    driver.print("driver");
    restore.print("restore");
    draw.print("draw");
    std::fflush(stdout);
}

void keep_up(MainWindow& window, bool on) {
    ViewSettings settings = window.workbench().view().settings();
    settings.keep_up = on;
    window.workbench().view().set(settings);
}

int run(MainWindow& window, const QString& path) {
    constexpr double kPatience = 600; // seconds
    Workbench& workbench = window.workbench();
    ErrorWatch errors(workbench);
    if (!path.isEmpty()) {
        const Clock::time_point begin = Clock::now();
        window.open_file(path);
        workbench.wait_until_idle();
        if (Status opened = errors.take(); !opened) {
            std::fprintf(stderr, "studio_bench: %s\n", opened.error().message.c_str());
            return int(opened.error().code);
        }
        while (!window.viewport().is_ready()) QApplication::processEvents(QEventLoop::AllEvents, 5);
        std::printf("opened in %.1f s: ", seconds_since(begin));
    }
    const Model& model = *workbench.state().model;
    std::printf("%zu vertices, driver %zu; %s\n", model.mesh.vertex_count(), model.driver().vertices.size(),
                window.viewport().timings().renderer.c_str());
    for (const bool on : {true, false}) {
        keep_up(window, on);
        wait_until_still(window, kPatience);
        pull(window, on ? "pull, coarser while moving" : "pull, all of it");
        workbench.wait_until_idle();
        workbench.reset_deformation();
    }
    workbench.make_body();
    workbench.wait_until_idle();
    for (const bool on : {true, false}) {
        keep_up(window, on);
        workbench.reset();
        wait_until_still(window, kPatience);
        pull(window, on ? "body, coarser while moving" : "body, all of it");
        workbench.pause();
        workbench.wait_until_idle();
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    prepare_application();
    QApplication application(argc, argv);
    MainWindow window(false);
    window.resize(1280, 800);
    window.show();
    while (!window.viewport().is_ready()) QApplication::processEvents(QEventLoop::AllEvents, 5);
    std::printf("first picture after %.0f ms\n", 1000 * seconds_since_start());
    std::fflush(stdout);
    return run(window, argc > 1 ? QString::fromLocal8Bit(argv[1]) : QString());
}
