// What the page's worker calls: a live world's bytes in, and after every frame where the driver of each body is.
// Compiled to WebAssembly from the library's own physics, and natively for the test that compares the bytes of both.
#include "filigree/physics/step/live_world.h"

#include <algorithm>
#include <optional>

using namespace filigree;

#ifdef __wasm__
#define EXPORTED(name) __attribute__((export_name(#name))) name
#else
#define EXPORTED(name) live_##name
#endif

namespace {

/// A driver that goes along with a body.
struct Driver {
    std::size_t body = 0;
    std::vector<Vec3f> points;
    std::vector<Mat3f> gradients;
};

struct Page {
    Simulation simulation;
    double frame_seconds;
    std::vector<Driver> drivers; ///< by the number of their attachment
    std::string start;           ///< Simulation::save
    FrameReport report;
    std::optional<Hand> hand; ///< what the user holds; its target is where the hand is now
    Vec3d wanted = Vec3d::Zero();
    std::vector<Hand> own_hands; ///< of the scene
};

const RunContext kContext(1);
std::vector<char> input;
std::optional<Page> page;
std::string message;
Eigen::Matrix4d matrix;

void look() {
    for (std::size_t driver = 0; driver < page->drivers.size(); ++driver)
        page->simulation.attached(driver, page->drivers[driver].points, page->drivers[driver].gradients, kContext);
}

/// The user's hand moves evenly during the next frame.
Status pull() {
    std::vector<Hand> hands = page->own_hands;
    if (page->hand) {
        Hand& hand = hands.emplace_back(*page->hand);
        const double now = page->simulation.time();
        hand.target.times = {now, now + page->frame_seconds};
        hand.target.values = {page->hand->target.constant, page->wanted};
    }
    return page->simulation.set_hands(std::move(hands), kContext);
}

Status begin_page() {
    Result<LiveWorld> live = read_live_world({input.data(), input.size()});
    input = {};
    if (!live) return live.error();
    std::vector<Hand> hands = live->world.hands;
    const double frame_seconds = 1 / live->options.frames_per_second;
    Result<Simulation> simulation =
        Simulation::create(std::move(live->world), std::move(live->actors), live->options, kContext);
    if (!simulation) return simulation.error();
    page.emplace(Page{std::move(*simulation), frame_seconds, {}, {}, {}, {}, Vec3d::Zero(), std::move(hands)});
    for (const AttachedPoints& points : live->attached) {
        if (points.pieces.empty())
            page->simulation.attach(points.body, points.points, kContext);
        else
            page->simulation.attach(points.body, points.points, points.pieces, kContext);
        page->drivers.push_back({points.body, points.points, std::vector<Mat3f>(points.points.size())});
    }
    page->start = page->simulation.save();
    look();
    return Success{};
}

/// 1; or 0, and text() says why.
int told(const Status& status) {
    message = status ? "" : status.error().message;
    return status ? 1 : 0;
}

} // namespace

extern "C" {

/// Room for the bytes of a live world.
char* EXPORTED(take)(unsigned size) {
    input.resize(size);
    return input.data();
}
/// Reads them, and puts everything at its start.
int EXPORTED(begin)() { return told(begin_page()); }
const char* EXPORTED(text)() { return message.c_str(); }

double EXPORTED(frame_seconds)() { return page->frame_seconds; }
unsigned EXPORTED(driver_count)() { return unsigned(page->drivers.size()); }
unsigned EXPORTED(driver_size)(unsigned driver) { return unsigned(page->drivers[driver].points.size()); }
unsigned EXPORTED(driver_body)(unsigned driver) { return unsigned(page->drivers[driver].body); }
/// Where a driver is: 3 numbers a vertex, m, and the 9 of its gradient, column by column, from metres to metres.
const float* EXPORTED(positions)(unsigned driver) { return page->drivers[driver].points.data()->data(); }
const float* EXPORTED(gradients)(unsigned driver) { return page->drivers[driver].gradients.data()->data(); }

/// One frame.
int EXPORTED(advance)() {
    if (const Status pulled = pull(); !pulled) return told(pulled);
    const Result<FrameReport> report = page->simulation.advance(kContext);
    if (!report) return told(report.error());
    page->report = *report;
    if (page->hand) page->hand->target.constant = page->wanted;
    look();
    return told(Success{});
}
unsigned EXPORTED(substeps)() { return page->report.substeps; }
unsigned EXPORTED(contacts)() { return unsigned(page->report.contacts); }
/// Parts of all bodies that break, as far as they have come apart.
unsigned EXPORTED(parts)() {
    std::size_t count = 0;
    for (std::size_t body = 0; body < page->simulation.body_count(); ++body)
        count += page->simulation.fracture(body).parts;
    return unsigned(count);
}
unsigned EXPORTED(particle_count)() {
    std::size_t count = 0;
    for (std::size_t body = 0; body < page->simulation.body_count(); ++body)
        count += page->simulation.body(body).particle_count();
    return unsigned(count);
}

/// Takes hold of a body. rest: a point on the body at rest, m; x, y, z: where that point is now.
void EXPORTED(grab)(unsigned body, double rest_x, double rest_y, double rest_z, double x, double y, double z) {
    Hand hand;
    hand.body = body;
    hand.point = Vec3d(rest_x, rest_y, rest_z).cast<float>();
    hand.target.constant = page->wanted = {x, y, z};
    page->hand = hand;
}
/// Where the hand is at the end of the next frame, m.
void EXPORTED(move)(double x, double y, double z) { page->wanted = {x, y, z}; }
void EXPORTED(let_go)() { page->hand.reset(); }

int EXPORTED(set_gravity)(double x, double y, double z) { return told(page->simulation.set_gravity({x, y, z})); }
/// Back to the start; the gravity stays.
int EXPORTED(drop_again)() {
    page->hand.reset();
    if (const Status back = page->simulation.restore(page->start); !back) return told(back);
    look();
    return told(Success{});
}
/// From an obstacle's shape to the world, 16 numbers, column by column.
const double* EXPORTED(obstacle_pose)(unsigned obstacle) {
    matrix = page->simulation.obstacle_pose(obstacle).matrix();
    return matrix.data();
}

} // extern "C"
