#include "workbench.h"

namespace filigree::studio {
struct Workbench::Content {};
Workbench::Workbench(QObject* parent) : QObject(parent) {
    State state;
    state.shape = Shape{};
    auto source = std::make_shared<Source>();
    source->mesh = filigree::make_shape(state.shape->name, state.shape->options).value();
    source->name = "Wavy cube";
    source->topology = analyse_topology(source->mesh, RunContext());
    Stripped stripped = strip(source->mesh, {}, RunContext()).value();
    state.strip_report = stripped.report;
    state.model = std::make_shared<const Model>(std::move(stripped.model));
    state.restore.level = state.model->finest_level();
    state.source = std::move(source);
    document_.replace(std::move(state));
}
Workbench::~Workbench() = default;
void Workbench::set_mode(Mode) {}
void Workbench::open(const std::string&) {}
void Workbench::save_model(const std::string&) {}
void Workbench::save_mesh(const std::string&) {}
void Workbench::save_driver(const std::string&) {}
void Workbench::export_meshes(const std::string&) {}
void Workbench::export_film(const std::string&, const FilmSettings&) {}
void Workbench::make_shape(const Shape&, const std::string&) {}
void Workbench::set_strip(const StripOptions&, const std::string&) {}
void Workbench::set_level(unsigned, const std::string&) {}
void Workbench::remove_detail() {}
void Workbench::add_detail() {}
void Workbench::set_law(std::optional<Law>) {}
void Workbench::set_thin_shell(bool) {}
void Workbench::set_warps(const Warps&, const std::string&) {}
void Workbench::reset_deformation() {}
void Workbench::pin(std::span<const Index>) {}
void Workbench::unpin(std::span<const Index>) {}
void Workbench::unpin_all() {}
void Workbench::begin_pull(Index, const Vec3d&) {}
void Workbench::pull_to(const Vec3d&) {}
void Workbench::end_pull() {}
void Workbench::set_body(const BodySettings&, const std::string&) {}
void Workbench::make_body() {}
void Workbench::play() {}
void Workbench::pause() {}
void Workbench::step() {}
void Workbench::reset() {}
void Workbench::animate() {}
bool Workbench::is_playing() const { return false; }
std::size_t Workbench::frame_count() const { return 0; }
std::size_t Workbench::frame() const { return 0; }
void Workbench::go_to_frame(std::size_t) {}
void Workbench::measure_error() {}
void Workbench::want_full(bool) {}
void Workbench::sample_inside_points(std::size_t) {}
void Workbench::wait_until_idle() { jobs_.wait_until_idle(); }
void Workbench::show_pose() {}
} // namespace filigree::studio
