// Many runs of scenes for one table: every value of every key that is set, in this process or in chunks.
#include "chunks.h"
#include "commands.h"
#include "simulate_report.h"

#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/temporary_file.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct SweepArguments {
    std::vector<std::string> scenes, sets;
    std::string output, chunk;
    std::size_t frames = 0; ///< 0: as the scene says
    bool check = false, finer = false;
};

/// A key, and what it is to be, one run after the other.
struct Setting {
    std::string name; ///< "body[2].friction"
    SceneValue key;   ///< without a value
    std::vector<std::string> values;
};

/// Parts between commas that stand in no brackets, braces or quotes.
std::vector<std::string> parts_of(std::string_view list) {
    std::vector<std::string> parts(1);
    int depth = 0;
    char quote = 0;
    for (const char c : list) {
        if (quote)
            quote = c == quote ? char(0) : quote;
        else if (c == '"' || c == '\'')
            quote = c;
        depth += !quote && (c == '[' || c == '{') ? 1 : !quote && (c == ']' || c == '}') ? -1 : 0;
        if (c == ',' && depth == 0 && !quote)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

/// A word is a text, without its quotes too.
std::string spelled_value(const std::string& value) {
    constexpr std::string_view kBegin = "ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz";
    constexpr std::string_view kGoOn = "0123456789-ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz";
    const bool is_word = value.find_first_of(kBegin) == 0 && value.find_first_not_of(kGoOn) == std::string::npos;
    const bool means_itself = value == "true" || value == "false" || value == "inf" || value == "nan";
    return is_word && !means_itself ? '"' + value + '"' : value;
}

Setting setting_of(const std::string& text) {
    const std::size_t is = text.find('='), dot = text.rfind('.', is);
    if (is == std::string::npos || dot == std::string::npos || dot == 0 || dot + 1 == is || is + 1 == text.size())
        refuse("--set must be TABLE.KEY=VALUE,VALUE, such as body.friction=0.2,0.4; '" + text + "' is not.");
    Setting setting{.name = text.substr(0, is), .key = {}, .values = parts_of(text.substr(is + 1))};
    setting.key.key = text.substr(dot + 1, is - dot - 1);
    setting.key.table = text.substr(0, dot);
    if (const std::size_t bracket = setting.key.table.find('['); bracket != std::string::npos) {
        const std::string number = setting.key.table.substr(bracket + 1);
        const auto [end, failed] = std::from_chars(number.data(), number.data() + number.size(), setting.key.entry);
        if (failed != std::errc() || std::string_view(end) != "]" || setting.key.entry == 0)
            refuse("--set: '" + setting.name + "' must name one of a list by its number from 1, such as body[2].KEY.");
        setting.key.table.resize(bracket);
    }
    return setting;
}

/// As a field of CSV.
std::string field(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + '"';
}

class Sweep {
public:
    Sweep(const SweepArguments& options, Session& session) : options_(options), session_(session) {
        for (const std::string& text : options.sets) settings_.push_back(setting_of(text));
        std::size_t runs = options.scenes.size();
        for (const Setting& setting : settings_) {
            runs *= setting.values.size();
            if (runs > kMostRuns) refuse(fmt::format("These are more than {} runs.", with_commas(kMostRuns)));
        }
        // All that can be refused, before any of it is simulated.
        for (std::size_t run = 0; run < runs; ++run) {
            runs_.push_back(choice(run));
            const Result<SceneFile> scene = read(run);
            if (!scene) refuse(scene.error().code, fmt::format("{}: {}", name_of(run), scene.error().message));
            job_ += runs_.back().label + scene->content + fmt::format(" frames {}\n", frames_of(*scene));
            for (const SceneBody& body : scene->bodies) add_mesh(body.mesh);
            for (const SceneObstacle& obstacle : scene->obstacles) add_mesh(obstacle.mesh);
        }
    }

    void make() {
        const double start = now_seconds();
        std::string table = header();
        for (std::size_t run = 0; run < runs_.size(); ++run) {
            session_.context().report("sweeping", double(run) / double(runs_.size()));
            table += require(rows(run));
        }
        session_.context().report("sweeping", 1);
        session_.begin_writing(options_.output);
        require(write_file(path_of(options_.output), table));
        const double seconds = now_seconds() - start;
        Report report;
        report.say(fmt::format("{}: {} in {}\n", options_.output, counted(runs_.size(), "run"), seconds_text(seconds)));
        report.set("output", options_.output);
        report.set("runs", runs_.size());
        report.set("seconds", seconds);
        report.set("doubtful_runs", doubtful_);
        session_.print(report);
    }

    /// Throws where rows of the table are not to be trusted; of the runs that this process made.
    void doubt() const {
        if (doubtful_.empty()) return;
        throw Doubt{fmt::format("{}: {} broke down (run {}), so {} rows are not to be trusted; the warnings say why.",
                                options_.output, counted(doubtful_.size(), "run"), fmt::join(doubtful_, ", "),
                                doubtful_.size() == 1 ? "its" : "their")};
    }

    void make_chunk() {
        const double start = now_seconds();
        WorkChunk chunk = chunk_of(options_.chunk);
        chunk.job = fmt::format("{} {} check {} finer {}", hash_of_bytes(job_), require(hash_of_files(meshes_)),
                                options_.check, options_.finer);
        SharedItems items{
            .path = path_of(options_.output), .what = "table of a sweep", .names = {}, .phase = "sweeping"};
        for (std::size_t run = 0; run < runs_.size(); ++run) items.names.push_back(fmt::format("run-{}", run + 1));
        session_.begin_writing(options_.output);
        const auto join = [&](const std::function<fs::path(std::size_t)>& file) -> Status {
            std::string table = header();
            for (std::size_t run = 0; run < runs_.size(); ++run) {
                const Result<std::string> lines = read_file(file(run));
                if (!lines) return lines.error();
                table += *lines;
            }
            // By a name of its own: another process may be joining the same.
            const fs::path whole = temporary_path(file(0).parent_path());
            if (Status written = write_file(whole, table); !written) return written;
            std::error_code failed;
            fs::rename(whole, path_of(options_.output), failed);
            return failed ? Status(cannot_write(path_of(options_.output), failed.value())) : Success{};
        };
        const auto is_there = [&] {
            std::error_code failed;
            return fs::exists(path_of(options_.output), failed);
        };
        const SharedItemsReport written = require(make_shared_items(
            items, chunk, [&](std::size_t run) { return rows(run); }, join, is_there, session_.context()));
        report_chunk(options_.output, chunk, written, "runs", now_seconds() - start, session_);
    }

private:
    static constexpr std::size_t kMostRuns = 100'000;

    /// What one run is of.
    struct Choice {
        std::string scene;
        std::vector<SceneValue> values;
        std::string label; ///< the first fields of its rows
    };

    static std::string counted(std::size_t count, const char* what) {
        return fmt::format("{} {}{}", with_commas(count), what, count == 1 ? "" : "s");
    }
    std::size_t frames_of(const SceneFile& scene) const { return options_.frames ? options_.frames : scene.frames; }
    std::string name_of(std::size_t run) const { return fmt::format("run {} of the sweep", run + 1); }
    void add_mesh(const std::string& mesh) {
        if (!mesh.empty() && std::ranges::find(meshes_, path_of(mesh)) == meshes_.end())
            meshes_.push_back(path_of(mesh));
    }

    /// Scenes outside, the last key's values innermost.
    Choice choice(std::size_t run) const {
        Choice chosen;
        std::size_t rest = run;
        std::vector<std::string> texts;
        for (auto setting = settings_.rbegin(); setting != settings_.rend(); ++setting) {
            texts.push_back(setting->values[rest % setting->values.size()]);
            rest /= setting->values.size();
            SceneValue& value = chosen.values.emplace_back(setting->key);
            value.value = spelled_value(texts.back());
        }
        std::ranges::reverse(chosen.values);
        std::ranges::reverse(texts);
        chosen.scene = options_.scenes[rest];
        chosen.label = fmt::format("{},{}", run + 1, field(chosen.scene));
        for (const std::string& text : texts) chosen.label += ',' + field(text);
        return chosen;
    }

    Result<SceneFile> read(std::size_t run) const { return read_scene(runs_[run].scene, runs_[run].values); }

    std::string header() const {
        std::string line = "run,scene";
        for (const Setting& setting : settings_) line += ',' + field(setting.name);
        line += ",body,particles,driver_vertices,mass_kg,frames,substeps,least_volume_ratio,"
                "most_stretch,most_contacts,deepest_contact_m,energy_start_j,energy_end_j";
        if (options_.check)
            line += ",check_rms_mean,check_rms_worst,check_max_worst,check_normal_p95_deg_mean,"
                    "check_normal_p95_deg_worst";
        if (options_.finer) line += ",finer_particles,attached_rms,attached_worst,restored_rms,restored_worst";
        return line + '\n';
    }

    /// A line a body.
    Result<std::string> rows(std::size_t run) {
        const Result<std::string> lines = simulated(run);
        if (lines || lines.error().code == ErrorCode::cancelled) return lines;
        return Error{lines.error().code, fmt::format("{}: {}", name_of(run), lines.error().message)};
    }

    Result<std::string> simulated(std::size_t number) {
        const RunContext quiet = session_.silent_context();
        Result<SceneFile> scene = read(number);
        if (!scene) return scene.error();
        scene->frames = frames_of(*scene);
        Result<ReadyScene> ready = set_up(*scene, quiet);
        if (!ready) return ready.error();
        Result<SceneRun> run = SceneRun::create(*scene, *ready, options_.check, quiet);
        if (!run) return run.error();
        if (Status advanced = run->advance_to(scene->frames, quiet); !advanced) return advanced.error();
        std::vector<FinerCheck> finer;
        if (options_.finer) {
            Result<std::vector<FinerCheck>> checked =
                check_against_finer(*scene, *ready, scene->frames, kFinerMoments, quiet);
            if (!checked) return checked.error();
            finer = std::move(*checked);
        }
        for (const auto& warnings : {ready->warnings, run->warnings()})
            for (const std::string& warning : warnings) session_.warn(fmt::format("{}: {}", name_of(number), warning));
        if (run->broke_down()) doubtful_.push_back(number + 1);
        std::string lines;
        for (std::size_t b = 0; b < ready->bodies.size(); ++b)
            lines += runs_[number].label + line_of(ready->bodies[b], *run, b, finer) + '\n';
        return lines;
    }

    /// The figures of a body and of its run; equal runs have equal figures, so there are no times.
    std::string line_of(const ReadyBody& body, const SceneRun& run, std::size_t b,
                        const std::vector<FinerCheck>& finer) const {
        const RunTotals& t = run.recording().totals;
        const double frames = double(std::max<std::uint64_t>(t.frames, 1));
        std::string line = fmt::format(",{},{},{},{},{},{},{},{},{},{},{},{}", field(body.name),
                                       body.body->particle_count(), body.model.driver().vertices.size(),
                                       body.report.mass, t.frames, t.substeps, t.least_volume_ratio, t.most_stretch,
                                       t.most_contacts, t.deepest_contact, t.start.total(), run.energy().total());
        if (options_.check) {
            const CheckTotals& check = run.recording().checks[b];
            line += fmt::format(",{},{},{},{},{}", check.rms_sum / frames, check.worst_rms, check.worst_max,
                                check.p95_sum / frames, check.worst_p95);
        }
        if (options_.finer)
            line += fmt::format(",{},{},{},{},{}", finer[b].particles, finer[b].attached.rms, finer[b].attached.worst,
                                finer[b].restored.rms, finer[b].restored.worst);
        return line;
    }

    const SweepArguments& options_;
    Session& session_;
    std::vector<Setting> settings_;
    std::vector<Choice> runs_;
    std::string job_; ///< all scenes as they are run
    std::vector<fs::path> meshes_;
    std::vector<std::size_t> doubtful_; ///< runs, from 1
};

void run(const SweepArguments& options, Session& session) {
    if (lower_extension(path_of(options.output)) != ".csv")
        refuse(ErrorCode::unsupported, options.output + ": a sweep's table is CSV; end its name in .csv.");
    check_folder_of(options.output);
    if (!options.chunk.empty()) (void)chunk_of(options.chunk);
    Sweep sweep(options, session);
    options.chunk.empty() ? sweep.make() : sweep.make_chunk();
    sweep.doubt();
}

} // namespace

Command sweep_command() {
    const auto options = std::make_shared<SweepArguments>();
    return {
        .name = "sweep",
        .text = "Simulate scenes with many values of their keys: a table with a row for each run and body",
        .options =
            OptionList{
                Option("scenes", options->scenes, "Scenes (.toml, see docs/scenes.md); give them before the options")
                    .is_read()
                    .required(),
                output_option(options->output, "The table (.csv)"),
                Option("--set", options->sets,
                       "TABLE.KEY=VALUE,VALUE: a run with each value. May come several times, for all combinations. "
                       "TABLE[N].KEY: only the N-th table")
                    .one_at_a_time(),
                Option("--frames", options->frames, "Number of frames of each run (default: that of the scene)")
                    .whole_from(1),
                Option("--check", options->check,
                       "More columns: how far the restored meshes are from meshes with every vertex moved by the "
                       "particles"),
                Option("--finer", options->finer,
                       "More columns: how far the meshes are from those of eight times the particles"),
                Option("--chunk", options->chunk,
                       "K/N: make only the K-th of N parts of the runs; other processes make the other parts")},
        .examples = "  filigree sweep bounce.toml -o table.csv --set body.young_modulus=1e4,1e5,1e6 --check\n"
                    "  filigree sweep a.toml b.toml -o table.csv --set simulation.mode=auto,explicit --chunk 3/40",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
