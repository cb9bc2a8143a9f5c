#include "viewport.h"

#include "overlay.h"
#include "stage.h"

#include "filigree/mesh/ray_hit.h"

#include <QElapsedTimer>
#include <QGuiApplication>
#include <QMouseEvent>
#include <QOpenGLContext>
#include <QOpenGLFunctions>
#include <QScreen>
#include <QStyle>
#include <QTimer>

#include <algorithm>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr int kStillAfter = 150;            // ms without a change: now all light is added up
constexpr double kBudget = 30;              // ms for a picture while things move
constexpr std::size_t kLarge = 40'000;      // triangles: from here on coarser levels are kept at hand
constexpr double kFlight = 0.25;            // s on the way to another camera
constexpr double kHintFades = 0.8;          // s
constexpr int kHoverAfter = 25;             // ms
constexpr double kKnobRadius = 9;           // pixels around a gizmo's knob that take hold of it
constexpr double kKnobMargin = 16;          // pixels between an arrow's knob and the picture's border
constexpr std::size_t kMostDefects = 5'000; // edges drawn
constexpr double kDegreesAPixel = 0.4;
constexpr double kZoomAStep = 1.15; // of the wheel
constexpr int kDragFrom = 3;        // pixels: below, it was a click

const QString kHint = "Drag the shape to pull it. Drag beside it to turn. Wheel to zoom.";

/// Where a mesh is looked at from when it is opened: from the front, a little from the right and above.
Vec3d first_direction(UpAxis up) {
    const Vec3d above = up_vector(up);
    return (view_direction(View::front, up) + 0.55 * view_direction(View::side, up) + 0.42 * above).normalized();
}

QString count_of(std::size_t count, const QString& of_what) {
    return QLocale(QLocale::English).toString(static_cast<qulonglong>(count)) + " " + of_what;
}

bool is_software(const std::string& renderer) {
    for (const char* name : {"llvmpipe", "softpipe", "SwiftShader", "swrast"})
        if (renderer.find(name) != std::string::npos) return true;
    return false;
}

} // namespace

struct Viewport::Content {
    enum class Drag { none, pending_pull, pull, orbit, pan, paint, gizmo };

    Workbench& workbench;
    Viewport& widget;
    Overlay* overlay;
    Stage stage;
    Drawing drawing;
    Timings timings;
    std::string trouble;
    bool is_software = false;

    // Drawing
    bool needs_preview = true;
    bool was_drawn = false;
    bool pose_moves = false; ///< since the last still picture
    LevelChange change;
    DrawingCost cost;
    unsigned drawn_level = 0;
    QElapsedTimer clock, since_preview;
    double last_preview = -1;
    QTimer frame_timer, still_timer, pass_timer, hint_timer;

    // Camera
    bool is_animated = true;
    std::optional<Camera> fly_from, fly_to;
    double fly_start = 0;
    QTimer fly_timer;
    Camera fitted;
    bool was_fitted = false;
    Box fitted_box;
    std::string fitted_name;
    bool was_split = false;
    std::shared_ptr<const MadeBody> framed_body; ///< that the view was widened for

    // Pointer
    Drag drag = Drag::none;
    int pressed_step = 0; ///< of the history when it began
    QPointF pressed, last;
    std::optional<Picked> held;
    std::optional<GizmoDrag> gizmo;
    std::optional<GizmoPart> hot_part;
    std::vector<Index> painted;
    bool unpaints = false;
    std::optional<Picked> hover;
    QPointF hover_at;
    QTimer hover_timer;
    double hint_strength = 1, hint_faded_from = -1;

    Content(Workbench& bench, Viewport& view)
        : workbench(bench), widget(view), overlay(new Overlay(&view)),
          stage(bench, [this](const std::function<void()>& work) { with_opengl(work); }) {
        clock.start();
    }

    double now() const { return 1e-9 * static_cast<double>(clock.nsecsElapsed()); }
    void with_opengl(const std::function<void()>& work) {
        if (!stage.is_started() || !widget.isValid()) return;
        const bool is_current = QOpenGLContext::currentContext() == widget.context();
        if (!is_current) widget.makeCurrent();
        work();
        if (!is_current) widget.doneCurrent();
    }
    const ViewSettings& settings() const { return workbench.view().settings(); }
    const Camera& camera() const { return workbench.view().camera(); }

    // Drawing
    void fail(const std::string& sentence);
    void touch(bool pose);
    void request_frame();
    bool is_moving() const;
    double ratio() const { return widget.devicePixelRatioF(); }
    unsigned pixels_high() const;
    std::vector<Tile> tiles(unsigned level, std::optional<unsigned> from);
    std::vector<std::pair<unsigned, unsigned>> tile_spans() const; ///< x and width, pixels of the screen
    unsigned level_for(bool moving);
    void draw_preview();
    bool begin_passes();
    void draw_pass();
    void note_timings(double draw, double restore);

    // Camera
    PictureSize tile_size() const;
    int tile_count() const { return settings().split ? 3 : 1; }
    QPointF in_tile(const QPointF& point) const;
    QPointF from_tile(const Vec3d& place, int tile) const;
    void fit(const Vec3d& direction, bool may_fly);
    Box body_room() const;
    void follow_body();
    void fly_to_camera(const Camera& camera);
    void stop_flight();
    Box opened_box() const;
    void follow_opened();

    // Pointer
    bool shows_gizmos() const;
    std::vector<GizmoShape> gizmos() const;
    Box rest_box() const;
    void update_hover();
    void show_cursor();
    void paint_pins(const QPointF& point);
    void finish_drag();
    void drop_drag();
    void fade_hint();
    void update_overlay();
    void overlay_tools(OverlayContent& content);
    void overlay_defects(OverlayContent& content);
};

Viewport::Viewport(Workbench& workbench, QWidget* parent)
    : QOpenGLWidget(parent), content_(std::make_unique<Content>(workbench, *this)) {
    setObjectName("viewport");
    setMouseTracking(true);
    setFocusPolicy(Qt::StrongFocus);
    setUpdateBehavior(PartialUpdate); // what is shown stays while the next sum is not good enough
    setMinimumSize(200, 150);
    Content& c = *content_;
    c.is_animated = style()->styleHint(QStyle::SH_Widget_Animation_Duration, nullptr, this) > 0;
    for (QTimer* timer : {&c.frame_timer, &c.still_timer, &c.hover_timer}) timer->setSingleShot(true);
    c.frame_timer.setTimerType(Qt::PreciseTimer);
    connect(&c.frame_timer, &QTimer::timeout, this, [this] { update(); });
    connect(&c.still_timer, &QTimer::timeout, this, [&c] { c.begin_passes(); });
    connect(&c.pass_timer, &QTimer::timeout, this, [&c] { c.draw_pass(); });
    connect(&c.hover_timer, &QTimer::timeout, this, [&c] { c.update_hover(); });
    connect(&c.fly_timer, &QTimer::timeout, this, [&c] {
        const double t = (c.now() - c.fly_start) / kFlight;
        if (!c.fly_to) return c.fly_timer.stop();
        const Camera to = *c.fly_to;
        if (t >= 1) c.stop_flight();
        c.workbench.view().set_camera(t >= 1 ? to : between(*c.fly_from, to, t * t * (3 - 2 * t)));
    });
    connect(&c.hint_timer, &QTimer::timeout, this, [&c] {
        c.hint_strength = std::clamp(1 - (c.now() - c.hint_faded_from) / kHintFades, 0.0, 1.0);
        if (c.hint_strength <= 0) c.hint_timer.stop();
        c.update_overlay();
    });
    connect(&c.stage, &Stage::changed, this, [&c](bool pose) { c.touch(pose); });
    connect(&workbench.view(), &ViewState::camera_changed, this, [&c] { c.touch(false); });
    connect(&workbench.view(), &ViewState::changed, this, [&c] {
        if (c.settings().split != std::exchange(c.was_split, c.settings().split) && c.was_fitted) {
            const double zoom = c.workbench.view().zoom();
            c.fit(c.camera().eye - c.camera().target, false);
            c.workbench.view().set_zoom(zoom);
            c.fitted = c.camera();
        }
        c.show_cursor();
        c.touch(false);
    });
    connect(&workbench, &Workbench::opened, this, [&c] { c.follow_opened(); });
    connect(&workbench.document(), &Document::changed, this, [&c](const State& before) {
        if (before.model != c.workbench.state().model) c.drop_drag();
    });
    connect(&workbench, &Workbench::mode_changed, this, [&c] { c.follow_body(); });
    connect(&workbench.playback(), &Playback::state_changed, this, [&c] { c.follow_body(); });
}

Viewport::~Viewport() {
    Content& c = *content_;
    if (context()) disconnect(context(), nullptr, this, nullptr); // it goes after what it would give back
    if (!c.stage.is_started() || !isValid()) return;
    makeCurrent();
    c.pass_timer.stop();
    c.stage.stop();
    c.drawing.clear();
    doneCurrent();
}

const Timings& Viewport::timings() const { return content_->timings; }
const std::string& Viewport::trouble() const { return content_->trouble; }
void Viewport::set_animated(bool animated) { content_->is_animated = animated; }

void Viewport::look_from(View view) { content_->fit(view_direction(view, content_->settings().up), true); }

void Viewport::show_all() {
    const Vec3d direction = content_->camera().eye - content_->camera().target;
    content_->fit(direction.norm() > 0 ? direction : first_direction(content_->settings().up), true);
}

// Drawing

void Viewport::initializeGL() {
    Content& c = *content_;
    QOpenGLFunctions* gl = context()->functions();
    const auto* name = reinterpret_cast<const char*>(gl->glGetString(GL_RENDERER));
    c.timings.renderer = name ? name : "";
    c.is_software = is_software(c.timings.renderer);
    const auto version = context()->format().version();
    if (version < std::pair(4, 3))
        return c.fail("The view needs OpenGL 4.3 and found " + std::to_string(version.first) + "." +
                      std::to_string(version.second) +
                      "; install a newer graphics driver, or start with LIBGL_ALWAYS_SOFTWARE=1.");
    connect(context(), &QOpenGLContext::aboutToBeDestroyed, this, [this, &c] {
        makeCurrent();
        c.pass_timer.stop();
        c.stage.stop();
        c.drawing.clear();
        doneCurrent();
    });
    c.trouble.clear();
    c.needs_preview = true;
    // Not from in here: what follows asks for this context again.
    QTimer::singleShot(0, this, [&c] {
        c.stage.start(c.is_software ? RestoreOn::cpu : RestoreOn::gpu);
        if (!c.was_fitted) c.follow_opened();
    });
}

void Viewport::resizeGL(int, int) {
    Content& c = *content_;
    const bool was_untouched = c.was_fitted && c.camera().eye == c.fitted.eye && c.camera().target == c.fitted.target;
    if (was_untouched && !c.fly_to) c.fit(c.camera().eye - c.camera().target, false);
    c.touch(false);
}

void Viewport::resizeEvent(QResizeEvent* event) {
    QOpenGLWidget::resizeEvent(event);
    content_->overlay->setGeometry(rect());
    content_->update_overlay();
}

void Viewport::showEvent(QShowEvent* event) {
    QOpenGLWidget::showEvent(event);
    QTimer::singleShot(0, this, [this] {
        if (isVisible() && !isValid())
            content_->fail("There is no OpenGL here, so the mesh cannot be shown; everything else works. Install a "
                           "graphics driver (Mesa draws without a graphics card).");
    });
}

void Viewport::changeEvent(QEvent* event) {
    QOpenGLWidget::changeEvent(event);
    if (event->type() == QEvent::PaletteChange || event->type() == QEvent::StyleChange) content_->touch(false);
}

void Viewport::paintGL() {
    Content& c = *content_;
    if (!c.stage.is_started() || !c.trouble.empty()) {
        QOpenGLFunctions* gl = context()->functions();
        const QColor color = palette().color(QPalette::Window);
        gl->glClearColor(color.redF(), color.greenF(), color.blueF(), 1);
        gl->glClear(GL_COLOR_BUFFER_BIT);
        return;
    }
    if (c.needs_preview)
        c.draw_preview();
    else if (!c.drawing.is_adding() || c.drawing.is_good_enough())
        c.drawing.show(defaultFramebufferObject());
}

void Viewport::finish_drawing() {
    Content& c = *content_;
    if (!c.stage.is_started() || !isValid()) return;
    if (c.fly_to) {
        const Camera to = *c.fly_to;
        c.stop_flight();
        c.workbench.view().set_camera(to);
    }
    // What is prepared may ask for more: the level, then what is drawn of it.
    do {
        c.stage.background().wait();
        if (c.stage.shown()) c.level_for(false);
    } while (c.stage.background().is_busy());
    c.change.advance(c.now() + LevelChange::kSeconds);
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
    Content& c = *content_;
    if (!c.trouble.empty() || !isVisible()) return true;
    if (!c.stage.is_started()) return false;
    return !c.workbench.state().model || (c.stage.shown() && !c.stage.is_preparing() && c.was_drawn);
}

bool Viewport::is_still() const {
    Content& c = *content_;
    if (!c.trouble.empty() || !c.stage.is_started()) return true;
    return !c.needs_preview && !c.drawing.is_adding() && !c.still_timer.isActive() && !c.is_moving() &&
           !c.stage.background().is_busy();
}

void Viewport::Content::fail(const std::string& sentence) {
    trouble = sentence;
    drawing.stop();
    pass_timer.stop();
    update_overlay();
}

bool Viewport::Content::is_moving() const {
    return drag != Drag::none || fly_to || change.from() || workbench.is_pulling() || workbench.is_playing();
}

void Viewport::Content::touch(bool pose) {
    if (!trouble.empty()) return;
    drawing.stop();
    pass_timer.stop();
    needs_preview = true;
    pose_moves = pose_moves || pose;
    if (drag == Drag::none) hover.reset(); // what is there now is another place
    still_timer.start(kStillAfter);
    request_frame();
}

void Viewport::Content::request_frame() {
    if (frame_timer.isActive()) return;
    const QScreen* screen = widget.screen();
    const double interval = 1 / std::max(20.0, screen ? screen->refreshRate() : 60.0);
    const double wait = last_preview < 0 ? 0 : last_preview + interval - now();
    frame_timer.start(std::max(0, static_cast<int>(std::floor(1000 * wait))));
}

unsigned Viewport::Content::pixels_high() const {
    return static_cast<unsigned>(std::max(1L, std::lround(widget.height() * ratio())));
}

std::vector<std::pair<unsigned, unsigned>> Viewport::Content::tile_spans() const {
    const auto wide = static_cast<unsigned>(std::max(3L, std::lround(widget.width() * ratio())));
    const auto count = static_cast<unsigned>(tile_count());
    std::vector<std::pair<unsigned, unsigned>> spans;
    for (unsigned i = 0; i < count; ++i) {
        const unsigned from = i * wide / count, to = (i + 1) * wide / count;
        spans.emplace_back(from, to - from);
    }
    return spans;
}

std::vector<Tile> Viewport::Content::tiles(unsigned level, std::optional<unsigned> from) {
    const auto spans = tile_spans();
    std::vector<Tile> result;
    const auto add = [&](Stage::Content content, std::size_t i) {
        result.push_back(
            {stage.scene(content, level, from, change.part(), widget.palette()), spans[i].first, spans[i].second});
    };
    if (spans.size() == 1) {
        add(Stage::Content::restored, 0);
    } else {
        add(Stage::Content::driver, 0);
        add(Stage::Content::restored, 1);
        add(Stage::Content::full, 2);
    }
    return result;
}

unsigned Viewport::Content::level_for(bool moving) {
    ShownModel& shown = *stage.shown();
    const Box& box = [&]() -> const Box& {
        static const Box none;
        const std::optional<unsigned> ready = shown.nearest_ready(shown.finest_level());
        return ready ? shown.level(*ready)->drawable.box() : none;
    }();
    const PictureSize size = {tile_size().width * ratio(), tile_size().height * ratio()};
    const unsigned calm = stage.calm_level(most_pixels_a_unit(camera(), box, size));
    const bool may_need_coarser =
        settings().level_by_distance || (settings().keep_up && shown.facts()[calm].triangles > kLarge);
    stage.ask_for_levels(calm, may_need_coarser);
    const unsigned ready = shown.nearest_ready(calm).value_or(calm);
    if (settings().level_by_distance && shown.level(change.to()) && shown.level(ready))
        change.start(ready, now());
    else
        change.set(ready);
    if (!moving || !settings().keep_up) return ready;
    const unsigned fast =
        level_to_keep_up(shown.facts(), ready, std::min(drawn_level, ready), cost, pose_moves, kBudget);
    return shown.nearest_ready(fast).value_or(ready);
}

void Viewport::Content::draw_preview() {
    const QOpenGLContext* context = widget.context();
    needs_preview = false;
    if (!stage.shown()) {
        const std::vector<Tile> empty = tiles(0, {});
        if (Status drawn = drawing.preview(empty, camera(), pixels_high()); !drawn) return fail(drawn.error().message);
        drawing.show(widget.defaultFramebufferObject());
        update_overlay();
        return;
    }
    const bool had_pose_moves = pose_moves;
    drawn_level = level_for(true);
    const bool melts = change.advance(now()) && drawn_level == change.to();
    std::vector<unsigned> levels = {drawn_level};
    if (melts) levels.push_back(*change.from());
    if (settings().driver || settings().split) levels.push_back(0);
    const double restore = stage.prepare(levels);

    QElapsedTimer timer;
    timer.start();
    const auto parts = tiles(drawn_level, melts ? change.from() : std::nullopt);
    if (Status drawn = drawing.preview(parts, camera(), pixels_high()); !drawn) return fail(drawn.error().message);
    drawing.show(widget.defaultFramebufferObject());
    if (is_software) context->functions()->glFinish(); // it has only taken note so far
    const double draw = 1e-6 * static_cast<double>(timer.nsecsElapsed());

    const LevelFacts& facts = stage.shown()->facts()[drawn_level];
    if (parts.size() == 1 && !melts) cost.learn_drawing(draw, facts.triangles);
    if (restore > 0 && had_pose_moves && levels.size() == 1 && stage.shown()->where() == RestoreOn::cpu)
        cost.learn_restoring(restore, facts.vertices);
    was_drawn = true;
    timings.part = melts ? change.part() : 1;
    note_timings(draw, restore);
    update_overlay();
    if (change.from()) touch(false);
}

void Viewport::Content::note_timings(double draw, double restore) {
    const double at = now(), gap = at - last_preview;
    constexpr double kPause = 0.5; // s: longer gaps are no frame rate
    if (last_preview >= 0 && gap < kPause && gap > 0) {
        const double rate = 1 / gap;
        timings.frames_per_second =
            timings.frames_per_second > 0 ? timings.frames_per_second + 0.2 * (rate - timings.frames_per_second) : rate;
    } else {
        timings.frames_per_second = 0;
    }
    last_preview = at;
    const LevelFacts& facts = stage.shown()->facts()[drawn_level];
    timings.driver = workbench.driver_milliseconds();
    if (restore > 0.02) timings.restore = stage.shown()->where() == RestoreOn::cpu ? restore : 0;
    timings.draw = draw;
    timings.vertices = facts.vertices;
    timings.triangles = facts.triangles;
    timings.level = drawn_level;
    QMetaObject::invokeMethod(
        &widget, [this] { Q_EMIT widget.timings_changed(); }, Qt::QueuedConnection);
}

bool Viewport::Content::begin_passes() {
    if (!trouble.empty() || !stage.is_started() || !stage.shown() || !widget.isValid()) return false;
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
    std::vector<unsigned> levels = {drawn_level};
    if (settings().driver || settings().split) levels.push_back(0);
    stage.prepare(levels);
    const Status begun = drawing.begin(tiles(drawn_level, {}), camera(), pixels_high());
    widget.doneCurrent();
    if (!begun) {
        fail(begun.error().message);
        return false;
    }
    const LevelFacts& facts = stage.shown()->facts()[drawn_level];
    timings.vertices = facts.vertices;
    timings.triangles = facts.triangles;
    timings.level = drawn_level;
    timings.frames_per_second = 0;
    QMetaObject::invokeMethod(
        &widget, [this] { Q_EMIT widget.timings_changed(); }, Qt::QueuedConnection);
    was_drawn = true;
    update_overlay();
    pass_timer.start(0);
    return true;
}

void Viewport::Content::draw_pass() {
    constexpr unsigned kShowEvery = 4;
    widget.makeCurrent();
    const bool was_added = drawing.add_pass();
    if (is_software) widget.context()->functions()->glFinish(); // so that the next event does not wait for many
    widget.doneCurrent();
    if (!was_added) pass_timer.stop();
    if (!was_added || (drawing.is_good_enough() && drawing.passes_done() % kShowEvery == 0)) widget.update();
}

// Camera

PictureSize Viewport::Content::tile_size() const {
    return {std::max(1.0, double(widget.width()) / tile_count()), std::max(1.0, double(widget.height()))};
}

QPointF Viewport::Content::in_tile(const QPointF& point) const {
    const double width = tile_size().width;
    const double tile = std::clamp(std::floor(point.x() / width), 0.0, double(tile_count() - 1));
    return {point.x() - tile * width, point.y()};
}

QPointF Viewport::Content::from_tile(const Vec3d& place, int tile) const {
    return {place.x() + tile * tile_size().width, place.y()};
}

void Viewport::Content::fit(const Vec3d& direction, bool may_fly) {
    Box box = stage.box();
    if (box.empty()) return;
    if (const Box room = body_room(); workbench.mode() == Mode::body && !room.empty()) {
        box.extend(room.min);
        box.extend(room.max);
    }
    stop_flight();
    const Camera from = camera();
    workbench.view().fit(box, direction.normalized(), tile_size().aspect());
    fitted = camera();
    fitted_box = box;
    const bool was_seen = std::exchange(was_fitted, true);
    if (may_fly && was_seen && is_animated) fly_to_camera(from);
}

/// Where the body starts, what it falls on and what stands around it; empty without a body.
Box Viewport::Content::body_room() const {
    const auto made = workbench.playback().made();
    Box room;
    if (!made) return room;
    const Vec3d origin = made->model->mesh.origin;
    room = world_bounds(made->model->mesh);
    const Surroundings& around = made->surroundings;
    if (around.has_ground) {
        int axis = 0;
        up_vector(settings().up).maxCoeff(&axis);
        Vec3d low = room.min, high = room.max;
        low[axis] = high[axis] = origin[axis] + around.ground_level;
        room.extend(low);
        room.extend(high);
    }
    for (const Mesh& obstacle : around.obstacles) {
        const Box box = bounds(obstacle.positions);
        room.extend(origin + box.min);
        room.extend(origin + box.max);
    }
    return room;
}

/// A body that falls out of the picture would be a pity: the view is widened when it is made, never narrowed.
void Viewport::Content::follow_body() {
    const auto made = workbench.mode() == Mode::body ? workbench.playback().made() : nullptr;
    if (made == framed_body) return;
    framed_body = made;
    const Box room = body_room();
    if (!made || !was_fitted || room.empty()) return;
    const PictureSize size = tile_size();
    bool is_seen = true;
    for (int k = 0; k < 8; ++k) {
        const Vec3d corner(k & 1 ? room.max.x() : room.min.x(), k & 2 ? room.max.y() : room.min.y(),
                           k & 4 ? room.max.z() : room.min.z());
        const Vec3d at = camera().project(corner, size.width, size.height);
        is_seen = is_seen && at.z() > 0 && at.x() >= 0 && at.y() >= 0 && at.x() <= size.width && at.y() <= size.height;
    }
    if (is_seen) return;
    stop_flight();
    const Camera from = camera();
    ViewState& view = workbench.view();
    view.fit(room, (from.eye - from.target).normalized(), size.aspect());
    fitted = camera();
    fitted_box = room;
    const double before = (from.eye - from.target).norm(), after = (fitted.eye - fitted.target).norm();
    if (before > after) view.set_zoom(after / before);
    if (is_animated) fly_to_camera(from);
}

void Viewport::Content::fly_to_camera(const Camera& from) {
    fly_to = camera();
    fly_from = from;
    fly_start = now();
    workbench.view().set_camera(from);
    fly_timer.start(15);
}

void Viewport::Content::stop_flight() {
    fly_timer.stop();
    fly_from.reset();
    fly_to.reset();
}

/// Of what was opened, as it is posed: the driver's box, and as much around it as the detail needs at rest.
Box Viewport::Content::opened_box() const {
    const State& state = workbench.state();
    Box box = world_bounds(state.source->mesh);
    const Pose* pose = workbench.pose();
    if (!pose || !state.model || pose->positions.size() != state.model->driver().vertices.size()) return box;
    const Vec3d origin = state.source->mesh.origin;
    const Box rest = bounds(driver_positions(*state.model)), posed = bounds(pose->positions);
    const double margin =
        std::max((origin + rest.min - box.min).maxCoeff(), (box.max - (origin + rest.max)).maxCoeff());
    if (posed.empty() || !posed.size().allFinite()) return box;
    box.min = origin + posed.min - Vec3d::Constant(margin);
    box.max = origin + posed.max + Vec3d::Constant(margin);
    return box;
}

void Viewport::Content::follow_opened() {
    const State& state = workbench.state();
    if (!state.source) return;
    // A shape whose slider moves stays where it is, unless it leaves.
    const Box box = opened_box();
    const std::string name = state.shape ? "shape " + state.shape->name : state.source->path;
    const bool is_same = was_fitted && name == fitted_name &&
                         (box.centre() - fitted_box.centre()).norm() < 0.25 * fitted_box.diagonal() &&
                         box.diagonal() < 1.5 * fitted_box.diagonal() && box.diagonal() > 0.6 * fitted_box.diagonal();
    fitted_name = name;
    if (is_same || box.empty()) return;
    stop_flight();
    workbench.view().fit(box, first_direction(settings().up), tile_size().aspect());
    fitted = camera();
    fitted_box = box;
    was_fitted = true;
}

QPointF Viewport::place_of(const Vec3d& world) const {
    const Content& c = *content_;
    const PictureSize size = c.tile_size();
    return c.from_tile(c.camera().project(world, size.width, size.height), c.tile_count() / 2);
}

std::optional<Viewport::Picked> Viewport::pick(const QPointF& point) {
    Content& c = *content_;
    ShownModel* shown = c.stage.shown();
    if (!shown || !rect().contains(point.toPoint())) return std::nullopt;
    if (shown->shared_model() != c.workbench.state().model) return std::nullopt; // its vertices are others
    const std::optional<unsigned> level = shown->nearest_ready(c.drawn_level);
    if (!level) return std::nullopt;
    const LevelShape& shape = *shown->level(*level)->shape;
    const std::span<const Vec3f> positions = c.stage.positions(*level);
    if (positions.empty()) return std::nullopt;
    const QPointF at = c.in_tile(point);
    const PictureSize size = c.tile_size();
    Camera::Ray ray = c.camera().ray(at.x(), at.y(), size.width, size.height);
    const Vec3d origin = c.stage.origin();
    const std::optional<ClipPlane> clip = c.stage.clip();
    constexpr int kMostLayers = 8; // of what is clipped away in front of what is not
    for (int layer = 0; layer < kMostLayers; ++layer) {
        const std::optional<RayHit> hit =
            first_hit(positions, shape.triangles(), ray.origin - origin, ray.direction, RunContext());
        if (!hit) return std::nullopt;
        const Vec3d place = ray.origin + hit->distance * ray.direction;
        if (clip && clip->normal.dot(place) > clip->offset) {
            ray.origin = place + 1e-9 * std::max(1.0, hit->distance) * ray.direction;
            continue;
        }
        Eigen::Index corner = 0;
        hit->barycentric.maxCoeff(&corner);
        return Picked{place, shape.finest_vertex(shape.triangles()[hit->triangle][static_cast<std::size_t>(corner)])};
    }
    return std::nullopt;
}

// Pointer

Box Viewport::Content::rest_box() const {
    const State& state = workbench.state();
    return state.source ? world_bounds(state.source->mesh) : Box();
}

bool Viewport::Content::shows_gizmos() const {
    return settings().gizmos && settings().tool == Tool::pull && !settings().split &&
           workbench.mode() == Mode::deform && !workbench.is_pulling() && workbench.state().model != nullptr;
}

std::vector<GizmoShape> Viewport::Content::gizmos() const {
    if (!shows_gizmos()) return {};
    std::vector<GizmoShape> shapes = gizmo_shapes(workbench.state().warps, rest_box(), camera().eye - camera().target);
    const PictureSize size = tile_size();
    const auto is_inside = [&](const Vec3d& place) {
        const Vec3d at = camera().project(place, size.width, size.height);
        return at.z() > 0 && std::min({at.x(), at.y(), size.width - at.x(), size.height - at.y()}) >= kKnobMargin;
    };
    // An arrow that leaves the picture is shorter, so that its knob can be reached.
    for (GizmoShape& shape : shapes) {
        if (!shape.has_tip || !is_inside(shape.line.front())) continue;
        const Vec3d from = shape.line.front(), way = shape.knob - from;
        for (double part = 0.9; part > 0.05 && !is_inside(shape.knob); part -= 0.1)
            shape.knob = shape.line.back() = from + part * way;
    }
    return shapes;
}

void Viewport::mousePressEvent(QMouseEvent* event) {
    Content& c = *content_;
    event->accept();
    if (c.drag != Content::Drag::none) return; // a second button while the first is down
    c.stop_flight();
    c.pressed = c.last = event->position();
    c.pressed_step = c.workbench.document().undo_stack().index();
    c.hover_timer.stop();
    using enum Content::Drag;
    const bool shift = event->modifiers() & Qt::ShiftModifier;
    if (event->button() == Qt::MiddleButton || (event->button() == Qt::LeftButton && shift)) {
        c.drag = pan;
    } else if (event->button() == Qt::RightButton) {
        c.drag = orbit;
    } else if (event->button() == Qt::LeftButton) {
        const QPointF at = c.in_tile(c.pressed);
        const auto part = gizmo_at(c.gizmos(), c.camera(), at.x(), at.y(), c.tile_size(), kKnobRadius);
        c.held = part || c.settings().tool == Tool::turn ? std::nullopt : pick(c.pressed);
        if (part) {
            c.gizmo.emplace(*part, c.workbench.state().warps, c.rest_box(), c.camera(), at.x(), at.y(), c.tile_size());
            c.hot_part = part;
            c.drag = Content::Drag::gizmo;
        } else if (!c.held) {
            c.drag = orbit;
        } else if (c.settings().tool == Tool::pin) {
            c.unpaints = event->modifiers() & (Qt::ControlModifier | Qt::AltModifier);
            c.painted.clear();
            c.drag = paint;
            c.paint_pins(c.pressed);
        } else {
            c.drag = pending_pull;
        }
    }
    c.show_cursor();
    c.update_overlay();
}

void Viewport::mouseMoveEvent(QMouseEvent* event) {
    Content& c = *content_;
    using enum Content::Drag;
    const QPointF at = event->position(), moved = at - c.last;
    const PictureSize size = c.tile_size();
    if (c.drag == none) {
        c.hover_at = at;
        if (!c.hover_timer.isActive()) c.hover_timer.start(kHoverAfter);
        return;
    }
    c.last = at;
    if (c.drag != pending_pull) c.fade_hint();
    if (c.drag == pending_pull) {
        const QPointF way = at - c.pressed;
        if (std::hypot(way.x(), way.y()) < kDragFrom) return;
        c.drag = pull;
        c.workbench.begin_pull(c.held->vertex, c.held->at);
        c.fade_hint();
    }
    if (c.drag == pull) {
        // Tiles have one camera, so the way from the press is the same in each of them.
        const QPointF tile_at = c.in_tile(c.pressed) + (at - c.pressed);
        c.workbench.pull_to(point_in_plane(c.camera(), c.held->at, tile_at.x(), tile_at.y(), size));
    } else if (c.drag == orbit) {
        c.workbench.view().orbit(-kDegreesAPixel * moved.x(), kDegreesAPixel * moved.y());
    } else if (c.drag == pan) {
        c.workbench.view().pan(-moved.x() / size.height, moved.y() / size.height);
    } else if (c.drag == paint) {
        c.paint_pins(at);
    } else if (c.drag == Content::Drag::gizmo) {
        const QPointF tile_at = c.in_tile(at);
        c.workbench.set_warps(c.gizmo->moved_to(tile_at.x(), tile_at.y()), "gizmo");
    }
    c.update_overlay();
}

void Viewport::mouseReleaseEvent(QMouseEvent* event) {
    event->accept();
    if (event->buttons() == Qt::NoButton) content_->finish_drag();
}

/// What is held belongs to a model that is not there any more.
void Viewport::Content::drop_drag() {
    if (drag == Drag::none || drag == Drag::orbit || drag == Drag::pan) return;
    const Drag was = std::exchange(drag, Drag::none);
    if (was == Drag::pull) workbench.cancel_pull();
    if (was == Drag::gizmo) workbench.document().end_merge();
    painted.clear();
    gizmo.reset();
    held.reset();
    hover.reset();
    show_cursor();
}

void Viewport::Content::finish_drag() {
    const Drag was = std::exchange(drag, Drag::none);
    if (was == Drag::pull) workbench.end_pull();
    if (was == Drag::gizmo) workbench.document().end_merge();
    if (was == Drag::paint && !painted.empty()) {
        std::sort(painted.begin(), painted.end());
        if (unpaints)
            workbench.unpin(painted);
        else
            workbench.pin(painted);
    }
    painted.clear();
    gizmo.reset();
    held.reset();
    hover_at = last;
    update_hover();
}

void Viewport::mouseDoubleClickEvent(QMouseEvent* event) {
    Content& c = *content_;
    event->accept();
    if (event->button() != Qt::LeftButton || c.settings().tool == Tool::pin) return mousePressEvent(event);
    const std::optional<Picked> picked = pick(event->position());
    if (!picked) return show_all();
    const Camera from = c.camera();
    Camera to = from;
    to.target = picked->at;
    to.eye += to.target - from.target;
    c.stop_flight();
    c.workbench.view().set_camera(to);
    if (c.is_animated) c.fly_to_camera(from);
}

void Viewport::wheelEvent(QWheelEvent* event) {
    Content& c = *content_;
    event->accept();
    c.stop_flight();
    ViewState& view = c.workbench.view();
    const double steps =
        event->pixelDelta().isNull() ? event->angleDelta().y() / 120.0 : event->pixelDelta().y() / 40.0;
    const double zoom = view.zoom();
    const double wanted = std::clamp(zoom * std::pow(kZoomAStep, steps), ViewState::kLeastZoom, ViewState::kMostZoom);
    const QPointF at = c.in_tile(event->position());
    if (zoom > 0 && wanted != zoom)
        view.set_camera(zoomed_about(c.camera(), wanted / zoom, at.x(), at.y(), c.tile_size()));
}

void Viewport::leaveEvent(QEvent* event) {
    QOpenGLWidget::leaveEvent(event);
    content_->hover_timer.stop();
    content_->hover.reset();
    if (content_->drag == Content::Drag::none) content_->hot_part.reset();
    content_->update_overlay();
}

void Viewport::keyPressEvent(QKeyEvent* event) {
    Content& c = *content_;
    if (event->key() != Qt::Key_Escape || c.drag == Content::Drag::none) return QOpenGLWidget::keyPressEvent(event);
    const Content::Drag was = std::exchange(c.drag, Content::Drag::none);
    if (was == Content::Drag::pull) {
        c.workbench.cancel_pull();
    } else if (was == Content::Drag::gizmo) {
        QUndoStack& history = c.workbench.document().undo_stack();
        c.workbench.document().end_merge();
        if (history.index() > c.pressed_step) history.undo();
    }
    c.painted.clear();
    c.gizmo.reset();
    c.held.reset();
    c.show_cursor();
    c.update_overlay();
}

void Viewport::Content::paint_pins(const QPointF& point) {
    const std::optional<Picked> picked = widget.pick(point);
    const State& state = workbench.state();
    if (!picked || !state.model) return;
    const std::vector<Vec3f>& driver = stage.pose().positions;
    const Vec3f at = (picked->at - stage.origin()).cast<float>();
    const auto reach = static_cast<float>(settings().grip * rest_box().diagonal());
    Index nearest = 0;
    const auto add = [&](Index vertex) {
        if (std::find(painted.begin(), painted.end(), vertex) == painted.end()) painted.push_back(vertex);
    };
    for (Index v = 0; v < driver.size(); ++v) {
        if ((driver[v] - at).norm() < (driver[nearest] - at).norm()) nearest = v;
        if ((driver[v] - at).norm() <= reach) add(v);
    }
    if (!driver.empty()) add(nearest);
}

void Viewport::Content::update_hover() {
    if (!trouble.empty() || drag != Drag::none) return;
    const QPointF at = in_tile(hover_at);
    hot_part = gizmo_at(gizmos(), camera(), at.x(), at.y(), tile_size(), kKnobRadius);
    hover = hot_part || settings().tool == Tool::turn || workbench.is_playing() ? std::nullopt : widget.pick(hover_at);
    show_cursor();
    update_overlay();
}

void Viewport::Content::show_cursor() {
    Qt::CursorShape shape = Qt::ArrowCursor;
    switch (drag) {
    case Drag::pull:
    case Drag::pending_pull:
    case Drag::gizmo:
        shape = Qt::ClosedHandCursor;
        break;
    case Drag::pan:
        shape = Qt::SizeAllCursor;
        break;
    case Drag::orbit:
        break;
    case Drag::paint:
        shape = Qt::CrossCursor;
        break;
    case Drag::none:
        if (hot_part)
            shape = Qt::PointingHandCursor;
        else if (hover)
            shape = settings().tool == Tool::pin ? Qt::CrossCursor : Qt::OpenHandCursor;
    }
    if (widget.cursor().shape() != shape) widget.setCursor(shape);
}

void Viewport::Content::fade_hint() {
    if (hint_faded_from >= 0) return;
    hint_faded_from = now();
    hint_timer.start(40);
}

// Overlay

void Viewport::Content::update_overlay() {
    OverlayContent content;
    content.trouble = trouble;
    if (!trouble.empty()) return overlay->set(std::move(content));
    const State& state = workbench.state();
    content.hint = state.model ? kHint : "Open a mesh, or drop one here.";
    content.hint_strength = state.model ? hint_strength : 1;

    const Mat3d basis = camera().basis();
    content.shows_triad = true;
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        content.triad[k] = {basis(axis, 0), -basis(axis, 1)};
        content.triad_depth[k] = basis(axis, 2);
    }
    if (ShownModel* shown = stage.shown()) {
        const LevelFacts& facts = shown->facts()[std::min(drawn_level, shown->finest_level())];
        if (settings().level_by_distance)
            content.note = QString("Level %1 of %2: ").arg(drawn_level).arg(shown->finest_level()) +
                           count_of(facts.vertices, "vertices");
        if (settings().split) {
            const double width = tile_size().width, height = tile_size().height;
            const auto tile = [&](int i) { return QRectF(i * width, 0, width, height); };
            content.captions = {{"Driver", count_of(shown->facts()[0].vertices, "vertices"), tile(0)},
                                {"Restored", count_of(facts.vertices, "vertices"), tile(1)},
                                {"Full deformation",
                                 stage.full_problem().empty() ? count_of(shown->model().mesh.vertex_count(), "vertices")
                                                              : QString::fromStdString(stage.full_problem()),
                                 tile(2)}};
        }
        const VertexColors& colors = stage.colors();
        const bool has_numbers = settings().coloring == Coloring::error || settings().coloring == Coloring::levels;
        if (!colors.values.empty() && has_numbers) {
            const bool is_error = settings().coloring == Coloring::error;
            content.legend = OverlayContent::Legend{is_error ? "Distance from the full deformation"
                                                             : "Level at which a vertex comes in",
                                                    is_error ? "% of the diagonal" : "",
                                                    colors.map,
                                                    colors.range,
                                                    is_error ? 100.0 : 1.0,
                                                    !is_error};
        }
        if (settings().coloring == Coloring::patches && content.note.isEmpty())
            content.note = QString::fromStdString(stage.patches_problem());
        overlay_tools(content);
        overlay_defects(content);
    }
    if (state.source && content.note.isEmpty()) {
        if (!(rest_box().diagonal() > 0))
            content.note = "All vertices are in one place, so there is no shape to show.";
        else if (state.source->mesh.face_count() == 0)
            content.note = "This mesh has no faces: its vertices are shown as balls.";
    }
    if (!stage.problem().empty()) content.note = QString::fromStdString(stage.problem());
    if (stage.is_preparing()) content.note = "Preparing the picture\u2026";
    overlay->set(std::move(content));
}

void Viewport::Content::overlay_tools(OverlayContent& content) {
    const State& state = workbench.state();
    const PictureSize size = tile_size();
    const auto place = [&](const Vec3d& world) {
        return from_tile(camera().project(world, size.width, size.height), tile_count() / 2);
    };
    const Vec3d origin = stage.origin();
    const std::vector<Vec3f>& driver = stage.pose().positions;
    const auto add_pin = [&](Index vertex) {
        if (vertex < driver.size()) content.pins.push_back({place(origin + driver[vertex].cast<double>()), false});
    };
    if (workbench.mode() == Mode::deform) {
        for (const Handle& handle : state.handles)
            if (handle.pinned)
                for (const Index vertex : handle.vertices)
                    if (!unpaints || std::find(painted.begin(), painted.end(), vertex) == painted.end())
                        add_pin(vertex);
        if (!unpaints)
            for (const Index vertex : painted) add_pin(vertex);
    }
    const double grip = settings().grip * rest_box().diagonal();
    if (hover && drag == Drag::none) {
        content.hover = hover_at;
        content.hover_radius =
            std::clamp(grip * pixels_a_unit(camera(), hover->at, size), 5.0, 0.4 * std::min(size.width, size.height));
    }
    if (drag == Drag::pull && workbench.mode() == Mode::body) {
        const Picked now_held = *held;
        ShownModel& shown = *stage.shown();
        const std::optional<unsigned> level = shown.nearest_ready(drawn_level);
        if (level) {
            const std::span<const Vec3f> positions = stage.positions(*level);
            const LevelShape& shape = *shown.level(*level)->shape;
            for (Index v = 0; v < positions.size(); ++v)
                if (shape.finest_vertex(v) == now_held.vertex)
                    content.pull = QLineF(place(origin + positions[v].cast<double>()), last);
        }
    }
    for (const GizmoShape& shape : gizmos()) {
        OverlayContent::Knob knob;
        knob.part = shape.part;
        for (const Vec3d& point : shape.line) knob.line << place(point);
        knob.at = place(shape.knob);
        knob.has_tip = shape.has_tip;
        knob.is_hot = hot_part == shape.part;
        if (knob.is_hot) knob.label = gizmo_label(shape.part, state.warps);
        content.knobs.push_back(std::move(knob));
    }
}

void Viewport::Content::overlay_defects(OverlayContent& content) {
    if (!settings().defects) return;
    ShownModel& shown = *stage.shown();
    const TopologyReport& topology = workbench.state().source->topology;
    QStringList found;
    for (const auto& [finding, name] : {std::pair(&topology.open_edges, "open edges (orange)"),
                                        std::pair(&topology.nonmanifold_edges, "non-manifold edges (violet)"),
                                        std::pair(&topology.inconsistent_edges, "edges of opposed faces (blue)"),
                                        std::pair(&topology.degenerate_faces, "faces without area (dots)")})
        if (finding->count > 0) found << count_of(finding->count, name);
    content.defect_summary = found.empty() ? QString("No defects: the mesh is closed and manifold") : found.join("\n");
    if (stage.defects().empty()) return;
    const unsigned finest = shown.finest_level();
    shown.ask(
        finest, false, stage.background(), [this](const std::function<void()>& work) { with_opengl(work); },
        [this](unsigned, const std::optional<Error>&) { update_overlay(); });
    const std::span<const Vec3f> positions = stage.positions(finest);
    if (positions.empty()) return;
    const PictureSize size = tile_size();
    const std::size_t step = (stage.defects().size() + kMostDefects - 1) / kMostDefects;
    for (std::size_t i = 0; i < stage.defects().size(); i += step) {
        const DefectEdge& edge = stage.defects()[i];
        const Vec3d a = camera().project(stage.origin() + positions[edge.a].cast<double>(), size.width, size.height);
        const Vec3d b = camera().project(stage.origin() + positions[edge.b].cast<double>(), size.width, size.height);
        if (a.z() <= 0 || b.z() <= 0) continue;
        const int tile = tile_count() / 2;
        content.defects.push_back({QLineF(from_tile(a, tile), from_tile(b, tile)), edge.is_open, edge.is_opposed});
    }
}

} // namespace filigree::studio
