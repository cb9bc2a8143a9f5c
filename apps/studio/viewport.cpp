#include "viewport.h"

#include "drawn_objects.h"
#include "viewport_overlay.h"

#include <QElapsedTimer>
#include <QOpenGLContext>
#include <QOpenGLFunctions>
#include <QScreen>
#include <QTimer>

#include <algorithm>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr int kStillAfter = 150;       // ms without a change: now all light is added up
constexpr double kBudget = 30;         // ms for a picture while things move
constexpr std::size_t kLarge = 40'000; // triangles: from here on coarser levels are kept at hand
constexpr double kHintFades = 0.8;     // s
constexpr unsigned kShowEvery = 4;     // passes

bool is_software_renderer(const std::string& name) {
    return std::ranges::any_of(std::array{"llvmpipe", "softpipe", "SwiftShader", "swrast"},
                               [&](const char* software) { return name.find(software) != std::string::npos; });
}

} // namespace

struct Viewport::Impl {
    Workbench& workbench;
    Viewport& widget;
    Overlay* overlay;
    DrawnObjects drawn;
    PictureCamera camera;
    Pointer pointer;
    Drawing drawing;
    Timings timings;
    std::string trouble;
    bool is_software = false;
    unsigned passes = 0; ///< of a still picture; 0: as many as suit its size

    bool needs_preview = true;
    bool was_drawn = false;
    bool pose_moves = false; ///< since the last still picture
    LevelChange change;
    DrawingCost cost;
    unsigned drawn_level = 0;
    QElapsedTimer clock;
    double last_preview = -1, hint_faded_from = -1; ///< seconds of the clock; below 0: not yet
    QTimer frame_timer, still_timer, pass_timer, hint_timer;

    Impl(Workbench& bench, Viewport& view)
        : workbench(bench), widget(view), overlay(new Overlay(&view)),
          drawn(bench, [this](const std::function<void()>& work) { with_opengl(work); }), camera(bench, drawn, view),
          pointer({bench, drawn, camera, [this](const QPointF& point) { return pick(point); }}, view) {
        clock.start();
    }

    double now() const { return 1e-9 * static_cast<double>(clock.nsecsElapsed()); }
    const ViewSettings& settings() const { return workbench.view().settings(); }

    // OpenGL

    void start_opengl() {
        drawn.start(is_software ? RestoreOn::cpu : RestoreOn::gpu);
        camera.follow_opened();
    }

    void stop_opengl() {
        widget.makeCurrent();
        pass_timer.stop();
        drawn.stop();
        drawing.clear();
        widget.doneCurrent();
    }

    void with_opengl(const std::function<void()>& work) {
        if (!drawn.is_started() || !widget.isValid()) return;
        const bool is_current = QOpenGLContext::currentContext() == widget.context();
        if (!is_current) widget.makeCurrent();
        work();
        if (!is_current) widget.doneCurrent();
    }

    void fail(const std::string& sentence) {
        trouble = sentence;
        drawing.stop();
        pass_timer.stop();
        update_overlay();
    }

    // Drawing

    bool is_moving() const {
        return pointer.is_dragging() || camera.is_flying() || change.from() || workbench.is_pulling() ||
               workbench.is_playing();
    }

    /// Another picture is due. pose: because the shape moves.
    void touch(bool pose) {
        if (!trouble.empty()) return;
        drawing.stop();
        pass_timer.stop();
        needs_preview = true;
        pose_moves = pose_moves || pose;
        pointer.forget_hover();
        still_timer.start(kStillAfter);
        request_frame();
    }

    void request_frame() {
        if (frame_timer.isActive()) return;
        const QScreen* screen = widget.screen();
        const double interval = 1 / std::max(20.0, screen ? screen->refreshRate() : 60.0);
        const double wait = last_preview < 0 ? 0 : last_preview + interval - now();
        frame_timer.start(std::max(0, static_cast<int>(std::floor(1000 * wait))));
    }

    unsigned pixels_high() const {
        return static_cast<unsigned>(std::max(1L, std::lround(widget.height() * widget.devicePixelRatioF())));
    }

    std::vector<Tile> tiles(unsigned level, std::optional<unsigned> from) {
        std::vector<TileShows> shown = {TileShows::restored};
        if (settings().split) shown = {TileShows::driver, TileShows::restored, TileShows::full};
        const auto wide = static_cast<unsigned>(std::max(3L, std::lround(widget.width() * widget.devicePixelRatioF())));
        const auto count = static_cast<unsigned>(shown.size());
        std::vector<Tile> result;
        for (unsigned i = 0; i < count; ++i) {
            const unsigned left = i * wide / count, right = (i + 1) * wide / count;
            result.push_back({drawn.scene(shown[i], level, from, change.part(), widget.palette()), left, right - left});
        }
        return result;
    }

    std::vector<unsigned> levels_drawn(std::optional<unsigned> from) const {
        std::vector<unsigned> levels = {drawn_level};
        if (from) levels.push_back(*from);
        if (settings().driver || settings().split) levels.push_back(0);
        return levels;
    }

    unsigned level_for(bool moving) {
        ShownModel& shown = *drawn.shown();
        const std::optional<unsigned> finest_ready = shown.nearest_ready(shown.finest_level());
        const Box box = finest_ready ? shown.level(*finest_ready)->drawable.box() : Box();
        const double ratio = widget.devicePixelRatioF();
        const PictureSize tile = camera.tile_size(), size = {tile.width * ratio, tile.height * ratio};
        const unsigned calm = drawn.calm_level(most_pixels_a_unit(camera.camera(), box, size));
        const bool may_need_coarser =
            settings().level_by_distance || (settings().keep_up && shown.facts()[calm].triangles > kLarge);
        drawn.ask_for_levels(calm, may_need_coarser);
        const unsigned ready = shown.nearest_ready(calm).value_or(calm);
        if (settings().level_by_distance && shown.level(change.to()) && shown.level(ready))
            change.start(ready, now());
        else
            change.set(ready);
        const bool is_in_pieces = workbench.state().source->pieces != nullptr; // they have no level but the driver
        if (!moving || !settings().keep_up || is_in_pieces) return ready;
        const unsigned fast =
            level_to_keep_up(shown.facts(), ready, std::min(drawn_level, ready), cost, pose_moves, kBudget);
        return shown.nearest_ready(fast).value_or(ready);
    }

    void draw_nothing() {
        QOpenGLFunctions* gl = widget.context()->functions();
        const QColor color = widget.palette().color(QPalette::Window);
        gl->glClearColor(color.redF(), color.greenF(), color.blueF(), 1);
        gl->glClear(GL_COLOR_BUFFER_BIT);
    }

    void draw_preview() {
        needs_preview = false;
        const bool has_model = drawn.shown() != nullptr, had_pose_moves = pose_moves;
        drawn_level = has_model ? level_for(true) : 0;
        const bool melts = has_model && change.advance(now()) && drawn_level == change.to();
        const std::optional<unsigned> from = melts ? change.from() : std::nullopt;
        const std::vector<unsigned> levels = levels_drawn(from);
        const double restore = has_model ? drawn.prepare(levels) : 0;

        QElapsedTimer timer;
        timer.start();
        const auto parts = tiles(drawn_level, from);
        if (Status status = drawing.preview(parts, camera.camera(), pixels_high()); !status)
            return fail(status.error().message);
        drawing.show(widget.defaultFramebufferObject());
        if (!has_model) return update_overlay();
        if (is_software) widget.context()->functions()->glFinish(); // it has only taken note so far
        timings.draw = milliseconds(timer);

        const LevelFacts& facts = drawn.shown()->facts()[drawn_level];
        const bool is_on_cpu = drawn.shown()->where() == RestoreOn::cpu;
        if (parts.size() == 1 && !melts) cost.learn_drawing(timings.draw, facts.triangles);
        if (restore > 0 && had_pose_moves && levels.size() == 1 && is_on_cpu)
            cost.learn_restoring(restore, facts.vertices);
        timings.part = melts ? change.part() : 1;
        timings.driver = workbench.driver_milliseconds();
        if (!workbench.pose())
            timings.restore = 0; // what the shape before took is no longer true
        else if (restore > 0.02)
            timings.restore = is_on_cpu ? restore : 0;
        note_frame_rate();
        note_level();
        if (change.from()) touch(false);
    }

    void note_frame_rate() {
        constexpr double kPause = 0.5; // s: longer gaps are no frame rate
        const double at = now(), gap = at - last_preview;
        if (last_preview >= 0 && gap < kPause && gap > 0) {
            double& rate = timings.frames_per_second;
            rate = rate > 0 ? rate + 0.2 * (1 / gap - rate) : 1 / gap;
        } else {
            timings.frames_per_second = 0;
        }
        last_preview = at;
    }

    /// What was drawn, for the status bar and over the picture.
    void note_level() {
        was_drawn = true;
        const LevelFacts& facts = drawn.shown()->facts()[drawn_level];
        timings.vertices = facts.vertices;
        timings.triangles = facts.triangles;
        timings.level = drawn_level;
        QMetaObject::invokeMethod(
            &widget, [this] { Q_EMIT widget.timings_changed(); }, Qt::QueuedConnection);
        update_overlay();
    }

    bool begin_passes() {
        if (!trouble.empty() || !drawn.is_started() || !drawn.shown() || !widget.isValid()) return false;
        if (is_moving()) {
            still_timer.start(kStillAfter);
            return false;
        }
        still_timer.stop();
        frame_timer.stop();
        needs_preview = false;
        pose_moves = false;
        widget.makeCurrent();
        drawn_level = level_for(false);
        change.set(drawn_level);
        drawn.prepare(levels_drawn({}));
        const Status begun = drawing.begin(tiles(drawn_level, {}), camera.camera(), pixels_high(), passes);
        widget.doneCurrent();
        if (!begun) {
            fail(begun.error().message);
            return false;
        }
        timings.frames_per_second = 0;
        note_level();
        pass_timer.start(0);
        return true;
    }

    void draw_pass() {
        widget.makeCurrent();
        const bool was_added = drawing.add_pass();
        if (is_software) widget.context()->functions()->glFinish(); // so that the next event does not wait for many
        widget.doneCurrent();
        if (!was_added) pass_timer.stop();
        if (!was_added || (drawing.is_good_enough() && drawing.passes_done() % kShowEvery == 0)) widget.update();
    }

    // Under and over the picture

    std::optional<Picked> pick(const QPointF& point) {
        ShownModel* shown = drawn.shown();
        if (!shown || !widget.rect().contains(point.toPoint())) return std::nullopt;
        if (shown->shared_model() != workbench.state().model) return std::nullopt; // its vertices are others
        const std::optional<unsigned> level = shown->nearest_ready(drawn_level);
        if (!level) return std::nullopt;
        const QPointF at = camera.in_tile(point);
        const PictureSize size = camera.tile_size();
        if (drawn.melt()) return drawn.pick_melt(camera.camera().ray(at.x(), at.y(), size.width, size.height));
        return shown->level(*level)->shape->pick(
            drawn.positions(*level), camera.camera().ray(at.x(), at.y(), size.width, size.height), drawn.clip());
    }

    void fade_hint() {
        if (hint_faded_from >= 0) return;
        hint_faded_from = now();
        hint_timer.start(40);
    }

    void update_overlay() {
        if (!trouble.empty()) {
            OverlayContent content;
            content.trouble = trouble;
            return overlay->set(std::move(content));
        }
        const double faded = hint_faded_from < 0 ? 0 : std::min(1.0, (now() - hint_faded_from) / kHintFades);
        if (faded >= 1) hint_timer.stop();
        overlay->set(overlay_content({workbench, drawn, camera, pointer}, drawn_level, 1 - faded));
    }
};

Viewport::Viewport(Workbench& workbench, QWidget* parent)
    : QOpenGLWidget(parent), impl_(std::make_unique<Impl>(workbench, *this)) {
    setObjectName("viewport");
    setMouseTracking(true);
    setFocusPolicy(Qt::StrongFocus);
    setUpdateBehavior(PartialUpdate); // what is shown stays while the next sum is not good enough
    setMinimumSize(200, 150);
    Impl& c = *impl_;
    c.frame_timer.setSingleShot(true);
    c.still_timer.setSingleShot(true);
    c.frame_timer.setTimerType(Qt::PreciseTimer);
    connect(&c.frame_timer, &QTimer::timeout, this, [this] { update(); });
    connect(&c.still_timer, &QTimer::timeout, this, [&c] { c.begin_passes(); });
    connect(&c.pass_timer, &QTimer::timeout, this, [&c] { c.draw_pass(); });
    connect(&c.hint_timer, &QTimer::timeout, this, [&c] { c.update_overlay(); });
    connect(&c.drawn, &DrawnObjects::changed, this, [&c](bool pose) { c.touch(pose); });
    connect(&workbench.view(), &ViewState::camera_changed, this, [&c] { c.touch(false); });
    connect(&workbench.view(), &ViewState::changed, this, [&c] { c.touch(false); });
    connect(&workbench.expected_error(), &ExpectedError::changed, this, [&c] { c.update_overlay(); });
    connect(&c.pointer, &Pointer::changed, this, [&c] { c.update_overlay(); });
    connect(&c.pointer, &Pointer::has_begun, this, [&c] { c.fade_hint(); });
}

Viewport::~Viewport() {
    if (context()) disconnect(context(), nullptr, this, nullptr); // it goes after what it would give back
    if (impl_->drawn.is_started() && isValid()) impl_->stop_opengl();
}

const Timings& Viewport::timings() const { return impl_->timings; }
const std::string& Viewport::trouble() const { return impl_->trouble; }
void Viewport::set_animated(bool animated) { impl_->camera.set_animated(animated); }
void Viewport::set_passes(unsigned passes) { impl_->passes = passes; }
void Viewport::set_covered(int height) { impl_->overlay->set_covered(height); }
void Viewport::look_from(View view) { impl_->camera.show_all_from(view_direction(view, impl_->settings().up)); }
void Viewport::show_all() { impl_->camera.show_all(); }
QPointF Viewport::place_of(const Vec3d& world) const { return impl_->camera.place_of(world); }
std::optional<Picked> Viewport::pick(const QPointF& point) { return impl_->pick(point); }

// OpenGL

void Viewport::initializeGL() {
    Impl& c = *impl_;
    const auto* name = reinterpret_cast<const char*>(context()->functions()->glGetString(GL_RENDERER));
    c.timings.renderer = name ? name : "";
    c.is_software = is_software_renderer(c.timings.renderer);
    const auto version = context()->format().version();
    if (version < std::pair(4, 3))
        return c.fail("The view needs OpenGL 4.3 and found " + std::to_string(version.first) + "." +
                      std::to_string(version.second) +
                      "; install a newer graphics driver, or start with LIBGL_ALWAYS_SOFTWARE=1.");
    connect(context(), &QOpenGLContext::aboutToBeDestroyed, this, [&c] { c.stop_opengl(); });
    c.trouble.clear();
    c.needs_preview = true;
    // Not from in here: what follows asks for this context again.
    QTimer::singleShot(0, this, [&c] { c.start_opengl(); });
}

// Events

void Viewport::resizeGL(int, int) {
    impl_->camera.follow_size();
    impl_->touch(false);
}

void Viewport::resizeEvent(QResizeEvent* event) {
    QOpenGLWidget::resizeEvent(event);
    impl_->overlay->setGeometry(rect());
    impl_->update_overlay();
}

void Viewport::showEvent(QShowEvent* event) {
    QOpenGLWidget::showEvent(event);
    QTimer::singleShot(0, this, [this] {
        if (isVisible() && !isValid())
            impl_->fail("There is no OpenGL here, so the mesh cannot be shown; everything else works. Install a "
                        "graphics driver (Mesa draws without a graphics card).");
    });
}

void Viewport::changeEvent(QEvent* event) {
    QOpenGLWidget::changeEvent(event);
    if (event->type() == QEvent::PaletteChange || event->type() == QEvent::StyleChange) impl_->touch(false);
}

void Viewport::mousePressEvent(QMouseEvent* event) {
    event->accept();
    impl_->pointer.press(*event);
}

void Viewport::mouseMoveEvent(QMouseEvent* event) { impl_->pointer.move(*event); }

void Viewport::mouseReleaseEvent(QMouseEvent* event) {
    event->accept();
    if (event->buttons() == Qt::NoButton) impl_->pointer.release();
}

void Viewport::mouseDoubleClickEvent(QMouseEvent* event) {
    event->accept();
    impl_->pointer.double_click(*event);
}

void Viewport::wheelEvent(QWheelEvent* event) {
    event->accept();
    impl_->pointer.wheel(*event);
}

void Viewport::leaveEvent(QEvent* event) {
    QOpenGLWidget::leaveEvent(event);
    impl_->pointer.leave();
}

void Viewport::keyPressEvent(QKeyEvent* event) {
    if (event->key() != Qt::Key_Escape || !impl_->pointer.escape()) QOpenGLWidget::keyPressEvent(event);
}

// Drawing

void Viewport::paintGL() {
    Impl& c = *impl_;
    if (!c.drawn.is_started() || !c.trouble.empty())
        c.draw_nothing();
    else if (c.needs_preview)
        c.draw_preview();
    else if (!c.drawing.is_adding() || c.drawing.is_good_enough())
        c.drawing.show(defaultFramebufferObject());
}

void Viewport::finish_drawing() {
    Impl& c = *impl_;
    if (!c.drawn.is_started() || !isValid()) return;
    c.camera.land();
    // What is prepared may ask for more: the level, then what is drawn of it.
    do {
        c.drawn.background().finish_all();
        if (c.drawn.shown()) c.level_for(false);
    } while (c.drawn.background().is_busy());
    c.change.set(c.change.to());
    if (!c.begin_passes()) return;
    makeCurrent();
    while (c.drawing.add_pass()) {
    }
    doneCurrent();
    c.pass_timer.stop();
    c.update_overlay();
    update();
}

bool Viewport::is_ready() const {
    const Impl& c = *impl_;
    if (!c.trouble.empty() || !isVisible()) return true;
    if (!c.drawn.is_started()) return false;
    return !c.workbench.state().model || (impl_->drawn.shown() && !c.drawn.is_preparing() && c.was_drawn);
}

bool Viewport::is_still() const {
    const Impl& c = *impl_;
    if (!c.trouble.empty() || !c.drawn.is_started()) return true;
    return !c.needs_preview && !c.drawing.is_adding() && !c.still_timer.isActive() && !c.is_moving() &&
           !impl_->drawn.background().is_busy();
}

} // namespace filigree::studio
