#include "handles_file.h"
#include "restore_options.h"

#include "filigree/deform/space_warp.h"

namespace filigree::cli {

namespace {

/// One warp option, kept in the order it was given in.
struct WarpStep {
    std::string kind;
    double amount;
};

std::unique_ptr<SpaceWarp> make_warp(const WarpStep& step, const Box& box, Axis axis, std::uint64_t seed) {
    if (step.kind == "stretch") return make_stretch(box, axis, step.amount);
    if (step.kind == "squeeze") return make_squeeze(box, axis, step.amount);
    if (step.kind == "bend") return make_bend(box, axis, step.amount);
    if (step.kind == "twist") return make_twist(box, axis, step.amount);
    if (step.kind == "taper") return make_taper(box, axis, step.amount);
    return make_smooth_random(box, step.amount, seed);
}

/// The warps one after the other, all over the box of the undeformed mesh.
std::unique_ptr<SpaceWarp> chain_steps(const std::vector<WarpStep>& steps, const Box& box, std::optional<Axis> axis,
                                       std::uint64_t seed) {
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    for (const WarpStep& step : steps) warps.push_back(make_warp(step, box, axis.value_or(longest_axis(box)), seed));
    return make_chain(std::move(warps));
}

struct Options {
    std::string input, output, handles, pose_output;
    std::vector<WarpStep> steps;
    std::optional<Axis> axis = {};
    std::uint64_t seed = 1;
    RestoreOptions restore;
};

Mesh deform_mesh(Mesh mesh, const Options& options, const RunContext& context) {
    if (options.handles.empty()) {
        warp_mesh(*chain_steps(options.steps, world_bounds(mesh), options.axis, options.seed), mesh, context);
        return mesh;
    }
    const HandlesFile handles = require(read_handles(options.handles));
    return require(move_mesh_by_handles(std::move(mesh), handles, context));
}

Pose deform_driver(const Model& model, const Options& options, const RunContext& context) {
    if (options.handles.empty()) {
        const auto warp = chain_steps(options.steps, world_bounds(model.mesh), options.axis, options.seed);
        return warp_pose(*warp, driver_positions(model), model.mesh.origin, context);
    }
    const HandlesFile handles = require(read_handles(options.handles));
    return require(pose_by_handles(model, handles, context));
}

Mesh restore_pose(const Model& model, const Pose& pose, const Options& options, const RunContext& context) {
    const Restorer restorer = require(Restorer::create(model, options.restore, context));
    return require(restorer.mesh(pose, context));
}

} // namespace

void add_deform(CLI::App& app, Session& session) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(
        "deform",
        "Deform a mesh (every vertex) or a model (its driver, then restore); options apply in the order given");
    command->add_option("file", options->input, "Mesh or model")->required();
    command->add_option("-o,--output", options->output, "Mesh file to write")->required();
    const auto add_step = [&](const std::string& kind, const std::string& text, const CLI::Validator& check) {
        command
            ->add_option_function<double>(
                "--" + kind,
                [options, kind](const double& amount) {
                    options->steps.push_back({kind, amount});
                },
                text)
            ->check(check)
            ->trigger_on_parse()
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    };
    add_step("stretch", "Scale along the axis by this factor", positive_number());
    add_step("squeeze", "Scale along the axis by this factor and across it so that the volume stays",
             positive_number());
    add_step("bend", "Bend the axis into an arc of this many degrees", finite_number());
    add_step("twist", "Turn the far end about the axis by this many degrees against the near end", finite_number());
    add_step("taper", "Scale cross-sections, from 1 at the near end to this factor at the far end", positive_number());
    add_step("random", "Smooth random displacement of up to this fraction of the diagonal", finite_number());
    command->add_option("--seed", options->seed, "Seed of --random")->check(whole_number(0))->capture_default_str();
    add_choice<Axis>(
        *command, "--axis", {{"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}},
        [options](Axis axis) { options->axis = axis; }, "Of all of these (unset: the longest side of the box)");
    command->add_option("--handles", options->handles,
                        "Pull parts and let the rest follow as rigidly as possible: a JSON file, see docs/handles.md");
    command->add_option("--pose", options->pose_output, "Models: also write the moved driver, with its gradients");
    add_restore_options(*command, options->restore);
    session.add_common_options(*command, "  filigree deform scan.fil -o bent.ply --bend 90 --twist 45\n"
                                         "  filigree deform scan.ply -o full.ply --bend 90 --twist 45\n"
                                         "  filigree deform scan.fil -o pulled.ply --handles pull.json");
    command->callback([options, &session] {
        session.begin();
        check_second_output("--pose", options->pose_output, options->output);
        if (options->steps.empty() == options->handles.empty())
            throw Failure{{ErrorCode::usage, "Say how to deform: one or more of --stretch, --squeeze, --bend, --twist, "
                                             "--taper and --random, or --handles FILE."}};
        const Session::Content content = session.read_any(options->input);
        const double start = now_seconds();
        const auto* model = std::get_if<Model>(&content.value);
        if (!model && !options->pose_output.empty())
            throw Failure{{ErrorCode::usage, "--pose writes a model's driver, and " + options->input + " is a mesh."}};
        const Pose pose = model ? deform_driver(*model, *options, session.context()) : Pose{};
        const Mesh mesh = model ? restore_pose(*model, pose, *options, session.context())
                                : deform_mesh(std::get<Mesh>(content.value), *options, session.context());
        const double seconds = now_seconds() - start;
        session.write_mesh(mesh, options->output, options->input);
        if (!options->pose_output.empty()) session.write_mesh(posed_driver(*model, pose), options->pose_output);
        session.print(fmt::format("{}: {} vertices deformed {} in {}\n", options->output,
                                  with_commas(mesh.vertex_count()), model ? "through the driver" : "one by one",
                                  seconds_text(seconds)),
                      {{"output", options->output},
                       {"vertices", mesh.vertex_count()},
                       {"through_driver", model != nullptr},
                       {"seconds", seconds}});
    });
}

} // namespace filigree::cli
