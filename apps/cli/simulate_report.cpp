#include "simulate_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

Json energy_json(const Energy& energy) {
    return {{"kinetic", energy.kinetic}, {"elastic", energy.elastic}, {"potential", energy.potential}};
}

std::string energy_text(const Energy& e) {
    return fmt::format("{:.4g} J  (kinetic {:.4g}, elastic {:.4g}, potential {:.4g})", e.total(), e.kinetic, e.elastic,
                       e.potential);
}

Json body_json(const ReadyBody& body) {
    return {{"name", body.name},
            {"particles", body.body->particle_count()},
            {"elements", body.body->cells.cells.size()},
            {"spacing_m", body.body->spacing()},
            {"mass_kg", body.report.mass},
            {"volume_m3", body.report.cells.volume},
            {"thin_cells", body.report.cells.thin_cells},
            {"loose_parts", body.report.cells.loose_parts},
            {"vertices", body.model.vertex_count()},
            {"driver_vertices", body.model.driver().vertices.size()}};
}

/// Whether a row for people is of it: of repeated bodies the first has one, for all.
bool has_row(const ReadyScene& ready, std::size_t b) {
    return ready.bodies[b].group.empty() || b == 0 || ready.bodies[b - 1].group != ready.bodies[b].group;
}

std::string row_name(const ReadyScene& ready, std::size_t b) {
    const ReadyBody& body = ready.bodies[b];
    if (body.group.empty()) return body.name;
    return fmt::format("{}, {} times", body.group, std::ranges::count(ready.bodies, body.group, &ReadyBody::group));
}

void report_body(const ReadyScene& ready, std::size_t b, Report& report) {
    const ReadyBody& body = ready.bodies[b];
    report.set("bodies").push_back(body_json(body));
    if (!has_row(ready, b)) return;
    report.row(row_name(ready, b),
               fmt::format("{} particles, {} cells of {:.3g} m; {:.4g} kg, {:.4g} m^3; {} vertices by a driver of {}",
                           with_commas(body.body->particle_count()), with_commas(body.body->cells.cells.size()),
                           body.body->spacing(), body.report.mass, body.report.cells.volume,
                           with_commas(body.model.vertex_count()), with_commas(body.model.driver().vertices.size())));
}

/// How fine the driver is, and the errors that follow; those of a body that melts follow from no rule.
void report_driver(const ReadyScene& ready, std::size_t b, const PoseSequence& poses, Json& json, Report& report) {
    const ReadyBody& body = ready.bodies[b];
    const DriverEdges& edges = body.driver;
    std::string text = fmt::format("edges {:.2g} spacings on average, {:.2g} at most", edges.mean, edges.longest);
    json = {{"mean_edge", edges.mean}, {"longest_edge", edges.longest}, {"on_long_edges", edges.on_long_edges}};
    if (!body.body->material.melts()) {
        const ExpectedError error = expected_error(poses, edges, body.model, *body.body);
        text += fmt::format("; expect {:.1e} of the diagonal from the spacing, {:.1e} from the driver", error.spacing,
                            error.driver);
        json["expected"] = {{"spacing", error.spacing}, {"driver", error.driver}};
    }
    if (has_row(ready, b)) report.row((body.group.empty() ? body.name : body.group) + ", driver", text);
}

/// What broke, and when. Times that have not come are null.
void report_fracture(const ReadyBody& body, const FractureReport& broken, Json& json, Report& report) {

    const auto when = [](double time) { return std::isfinite(time) ? Json(time) : Json(); };
    Json times = Json::array();
    for (const double time : broken.broke) times.push_back(when(time));
    json = {{"pieces", broken.pieces},
            {"parts", broken.parts},
            {"first_s", when(broken.first)},
            {"broke_s", times},
            {"crack_area_m2", broken.crack_area},
            {"broken_area_m2", broken.broken_area},
            {"dissipated_j", broken.dissipated}};
    report.row(
        body.name + ", cracks",
        std::isfinite(broken.first)
            ? fmt::format("{} parts of {} pieces, the first crack at {:.3g} s; {:.3g} of {:.3g} m^2 broken, {:.3g} J",
                          with_commas(broken.parts), with_commas(broken.pieces), broken.first, broken.broken_area,
                          broken.crack_area, broken.dissipated)
            : fmt::format("none; {} pieces hold", with_commas(broken.pieces)));
}

/// A frame's milliseconds, on average.
void report_times(const RunTimes& times, Report& report) {
    const auto ms = [&](double seconds) { return 1e3 * seconds / double(std::max<std::uint64_t>(times.frames, 1)); };
    const double all = times.elastic + times.contact + times.other + times.coupling + times.restore;
    report.add("time a frame",
               fmt::format("{:.3g} ms elastic, {:.3g} contacts, {:.3g} other, {:.3g} driver, {:.3g} restore: {:.3g} "
                           "in all",
                           ms(times.elastic), ms(times.contact), ms(times.other), ms(times.coupling), ms(times.restore),
                           ms(all)),
               "ms_a_frame",
               {{"elastic", ms(times.elastic)},
                {"contacts", ms(times.contact)},
                {"other", ms(times.other)},
                {"driver", ms(times.coupling)},
                {"restore", ms(times.restore)}});
}

void report_totals(const RunTotals& t, Report& report) {
    report.row("cells",
               fmt::format("{:.3g} of their volume at least, stretched {:.3g} times at most{}", t.least_volume_ratio,
                           t.most_stretch, t.least_volume_ratio <= 0 ? "; some were inside out" : ""));
    report.set("least_volume_ratio", t.least_volume_ratio);
    report.set("most_stretch", t.most_stretch);
    report.row("contacts", fmt::format("{} points at most, {:.3g} m deep at most, {:.3g} m in bodies",
                                       with_commas(t.most_contacts), t.deepest_contact, t.deepest_in_matter));
    report.set("most_contacts", t.most_contacts);
    report.set("deepest_contact_m", t.deepest_contact);
    report.set("deepest_in_matter_m", t.deepest_in_matter);
}

void report_frames(const SceneFile& scene, const SceneRun& run, Report& report) {
    const RunTotals& t = run.recording().totals;
    const double mean = double(t.substeps) / double(std::max<std::uint64_t>(t.frames, 1));
    const std::uint64_t least = t.frames ? t.least_substeps : 0;
    report.add("frames", fmt::format("{} of {}, at {} a second", t.frames, scene.frames, scene.step.frames_per_second),
               "frames", t.frames);
    report.set("frames_per_second", scene.step.frames_per_second);
    report.add("substeps", fmt::format("{} to {} a frame, {:.3g} on average", least, t.most_substeps, mean), "substeps",
               {{"min", least}, {"mean", mean}, {"max", t.most_substeps}});
    report_times(run.times(), report);
    report_totals(t, report);
    const Energy end = run.energy();
    report.add("energy at the start", energy_text(t.start), "energy_start", energy_json(t.start));
    report.add("and at the end", energy_text(end), "energy_end", energy_json(end));
    for (const std::string& note : run.notes()) report.row("note", note);
    report.set("notes", run.notes());
    if (t.clamped_particles) report.row("clamped", with_commas(t.clamped_particles) + " motions of particles");
    report.set("clamped_particles", t.clamped_particles);
}

void report_checks(const ReadyScene& ready, const SceneRun& run, Report& report) {
    const RunTimes& times = run.times();
    const double frames = double(std::max<std::uint64_t>(run.frame(), 1));
    const std::vector<CheckTotals>& checks = run.recording().checks;
    for (std::size_t b = 0; b < checks.size(); ++b) {
        const CheckTotals& check = checks[b];
        report.row(
            ready.bodies[b].name + ", restored",
            fmt::format("rms {:.2e} of the diagonal from all attached (worst frame {:.2e}, worst vertex {:.2e}); "
                        "95 % of normals within {:.3g} degrees (worst frame {:.3g})",
                        check.rms_sum / frames, check.worst_rms, check.worst_max, check.p95_sum / frames,
                        check.worst_p95));
        if (check.worst_fading_rms > 0)
            report.row(ready.bodies[b].name + ", fading",
                       fmt::format("rms {:.2e} of the diagonal from all attached in the worst frame, before it fades",
                                   check.worst_fading_rms));
        report.set("bodies").at(b)["check"] = {{"rms_mean", check.rms_sum / frames},
                                               {"rms_worst", check.worst_rms},
                                               {"max_worst", check.worst_max},
                                               {"normal_p95_deg_mean", check.p95_sum / frames},
                                               {"normal_p95_deg_worst", check.worst_p95},
                                               {"fading_rms_worst", check.worst_fading_rms}};
    }
    if (checks.empty() || times.frames == 0) return;
    const double direct = 1e3 * times.direct / double(times.frames);
    const double ratio = times.direct / (times.coupling + times.restore);
    report.add("attached directly",
               fmt::format("{:.3g} ms a frame: {:.3g} times the driver and the restore", direct, ratio),
               "direct_ms_a_frame", direct);
    report.set("direct_ratio", ratio);
}

} // namespace

void report_run(const SceneFile& scene, const ReadyScene& ready, const SceneRun& run, Report& report) {
    report.set("bodies", Json::array());
    for (std::size_t b = 0; b < ready.bodies.size(); ++b) report_body(ready, b, report);
    for (std::size_t b = 0; b < ready.bodies.size(); ++b)
        report_driver(ready, b, run.recording().poses[b], report.set("bodies").at(b)["driver"], report);
    for (std::size_t b = 0; b < ready.bodies.size(); ++b)
        if (run.fracture(b).breaks)
            report_fracture(ready.bodies[b], run.fracture(b), report.set("bodies").at(b)["fracture"], report);
    report_frames(scene, run, report);
    report_checks(ready, run, report);
}

void report_finer(const ReadyScene& ready, std::span<const FinerCheck> checks, Report& report) {
    const auto error_json = [](const TruthError& error) -> Json {
        return {{"rms_mean", error.rms}, {"max_worst", error.worst}};
    };
    for (std::size_t b = 0; b < checks.size(); ++b) {
        const FinerCheck& check = checks[b];
        const double ratio = check.attached.rms > 0 ? check.restored.rms / check.attached.rms : 1;
        report.row(ready.bodies[b].name + ", finer",
                   fmt::format("{} particles: all attached are {:.2e} of the diagonal from theirs (worst vertex "
                               "{:.2e}), restored {:.2e}, {:.3g} times that (worst vertex {:.2e})",
                               with_commas(check.particles), check.attached.rms, check.attached.worst,
                               check.restored.rms, ratio, check.restored.worst));
        report.set("bodies").at(b)["finer"] = {{"particles", check.particles},
                                               {"attached", error_json(check.attached)},
                                               {"restored", error_json(check.restored)}};
    }
}

} // namespace filigree::cli
