// What every command shares: its common options, reading and writing, warnings, progress, output.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/io/gltf.h"
#include "filigree/io/mesh_file.h"
#include "filigree/mesh/mesh_distance.h"

#include <functional>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace filigree::cli {

using Json = nlohmann::ordered_json;

/// An Error on its way to main, which prints it and leaves with its code.
struct Failure {
    Error error;
};

/// The value, or a Failure.
template <class T>
T require(Result<T> result) {
    if (!result) throw Failure{result.error()};
    return std::move(result).value();
}

/// One run of the program.
class Session {
public:
    bool json = false, quiet = false;
    unsigned threads = 0;

    /// Adds --json, --threads and --quiet, and a footer with examples.
    void add_common_options(CLI::App& command, const std::string& examples);
    /// Makes the context when the options are known; from here on Ctrl-C and its like (SIGTERM, SIGHUP) cancel, and a
    /// reader that has gone away is an error like any other.
    void begin();
    const RunContext& context() const { return *context_; }

    Mesh read_mesh(const std::string& path);
    /// poses: where to put the model's own; null: not wanted.
    Model read_model(const std::string& path, PoseSequence* poses = nullptr);
    struct Content {
        std::variant<Mesh, Model> value;
        std::size_t bytes;                   ///< of the file
        PoseSequence poses;                  ///< of a model that has been moved
        std::optional<GltfScene> scene = {}; ///< that the mesh is of, where it was asked for
    };
    /// A mesh or a model, told by the content. keep_scene: whether what else a glTF file holds is wanted.
    Content read_any(const std::string& path, bool keep_scene = false);
    /// source: the file that the mesh came from, for formats that take materials in (GLB); empty: none.
    void write_mesh(const Mesh& mesh, const std::string& path, const std::string& source = {});
    void write_model(const Model& model, const std::string& path, const PoseSequence& poses = {});

    /// To be called before a file is written in another way: the last chance to cancel.
    void begin_writing(const std::string& path);

    /// Goes to stderr at once, unless quiet, and into the JSON; a sentence that was said is not said again.
    void warn(const std::string& sentence);

    /// The result: `text` for people, or with --json `object` with the warnings added. Standard output, unless a mesh
    /// or a model went there. With --quiet a text that only tells of a file written is left out.
    void print(const std::string& text, Json object);

private:
    std::string read_bytes(const std::string& path) const;
    Mesh parse_mesh(const std::string& bytes, const std::string& path);

    std::optional<RunContext> context_;
    std::vector<std::string> warnings_;
    bool wrote_file_ = false;
    bool standard_output_taken_ = false; ///< by a mesh or a model
};

/// An option that is one of a few words, each of which stands for a value.
template <class T>
CLI::Option* add_choice(CLI::App& command, const std::string& name, const std::map<std::string, T>& choices,
                        std::function<void(T)> set, const std::string& text) {
    return command
        .add_option_function<std::string>(
            name, [choices, set](const std::string& word) { set(choices.at(word)); }, text)
        ->check(CLI::IsMember(choices))
        ->type_name("WORD");
}

/// Checks of an option's number, by rules that are the same in every locale.
CLI::Validator finite_number();
CLI::Validator positive_number();
CLI::Validator whole_number(std::int64_t least);

/// Refuses, before any work, a second output (`option`; empty: none) that goes where the first goes, or has no format
/// that we know.
void check_second_output(const std::string& option, const std::string& path, const std::string& first);

/// A line on stderr.
void say(const std::string& line);

/// Lines "name   value" with the values in one column.
class Table {
public:
    void row(std::string name, std::string value) { rows_.emplace_back(std::move(name), std::move(value)); }
    std::string text() const;

private:
    std::vector<std::pair<std::string, std::string>> rows_;
};

/// 1234567 as "1,234,567".
std::string with_commas(std::size_t count);
/// "3.2e-05 of the diagonal (0.0012 units)".
std::string distance_text(const MeshDistance& distance, double units);
/// Seconds with three digits that matter.
std::string seconds_text(double seconds);

double now_seconds(); ///< a monotonic clock
/// Median seconds of a call: at least five, for about 0.4 seconds.
double median_seconds(const std::function<void()>& work);

/// Vertices of make_wavy_cube with so many quads along a side.
constexpr std::size_t wavy_cube_vertices(std::size_t resolution) { return 6 * resolution * resolution + 2; }

// One command each, in the file of its name.
void add_make(CLI::App& app, Session& session);
void add_info(CLI::App& app, Session& session);
void add_remesh(CLI::App& app, Session& session);
void add_strip(CLI::App& app, Session& session);
void add_level(CLI::App& app, Session& session);
void add_deform(CLI::App& app, Session& session);
void add_restore(CLI::App& app, Session& session);
void add_compare(CLI::App& app, Session& session);
void add_bench(CLI::App& app, Session& session);
void add_demo(CLI::App& app, Session& session);
void add_render(CLI::App& app, Session& session);
void add_sample(CLI::App& app, Session& session);
void add_simulate(CLI::App& app, Session& session);
void add_figures(CLI::App& app, Session& session);
void add_export(CLI::App& app, Session& session);

} // namespace filigree::cli
