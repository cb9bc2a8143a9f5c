// What every command shares: its common options, reading and writing, warnings, progress, output.
#pragma once

#include "options.h"
#include "report.h"

#include "filigree/context.h"
#include "filigree/core/now_seconds.h"
#include "filigree/file.h"
#include "filigree/io/file.h"
#include "filigree/io/gltf.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh.h"
#include "filigree/result.h"
#include "filigree/strip.h"

#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace filigree::cli {

/// An Error on its way to main, which prints it and leaves with its code.
struct Failure {
    Error error;
};
[[noreturn]] inline void refuse(ErrorCode code, const std::string& sentence) { throw Failure{{code, sentence}}; }
/// What the arguments ask for makes no sense.
[[noreturn]] inline void refuse(const std::string& sentence) { refuse(ErrorCode::usage, sentence); }

/// The outputs are written and are not to be trusted: the program leaves with kDoubtful.
struct Doubt {
    std::string sentence;
};
inline constexpr int kDoubtful = 10;

/// The result; an error of that kind gets a sentence more, of what the command line has against it.
template <class T>
Result<T> with_hint(Result<T> result, ErrorCode code, const std::string& hint) {
    if (!result && result.error().code == code) return Error{code, result.error().message + " " + hint};
    return result;
}

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

    /// --json, --threads and --quiet.
    OptionList common_options();
    /// Tells that an option was given, by its long name, with what came behind it.
    void note_given(const std::string& option, std::vector<std::string> values) {
        given_.push_back({option, std::move(values)});
    }
    /// The first of these options that was given, as the command's table orders them; empty: none was.
    std::string first_given(const std::vector<std::string>& options) const;
    /// All options that were given, with their values, but these: what a result depends on beside its inputs.
    std::string settings_but(const std::vector<std::string>& options) const;

    /// Makes the context when the options are known; from here on Ctrl-C and its like (SIGTERM, SIGHUP) cancel, and a
    /// reader that has gone away is an error like any other.
    void begin();
    const RunContext& context() const { return *context_; }
    /// The same without progress, for parts of a work whose whole is shown.
    RunContext silent_context() const;

    /// A file to read a part of; while a pipe is waited for, Ctrl-C ends the program.
    FileReader open(const std::string& path) const;
    /// The same of a model, and nothing else.
    FileReader open_model(const std::string& path) const;

    Mesh read_mesh(const std::string& path);
    /// A mesh of a file's bytes; its warnings are said.
    Mesh parse_mesh(const std::string& bytes, const std::string& path);
    /// poses: where to put the model's own; null: not wanted.
    Model read_model(const std::string& path, PoseSequence* poses = nullptr);
    Model read_model(const FileReader& file, const std::string& path, PoseSequence* poses = nullptr);
    /// What a model's file says of it, and one of its levels, without reading all of it.
    ModelOutline outline(const FileReader& file, const std::string& path) const;
    Mesh read_level(const FileReader& file, unsigned level, const std::string& path) const;
    struct Content {
        std::variant<Mesh, Model> value;
        PoseSequence poses; ///< of a model that has been moved
    };
    /// A mesh or a model, told by the content.
    Content read_any(const std::string& path);
    Content read_any(const FileReader& file, const std::string& path);
    /// source: the file that the mesh came from, for formats that take materials in (GLB); empty: none.
    void write_mesh(const Mesh& mesh, const std::string& path, const std::string& source = {});
    void write_model(const Model& model, const std::string& path, const PoseSequence& poses = {});

    /// To be called before a file is written in another way: the last chance to cancel.
    void begin_writing(const std::string& path);

    /// Goes to stderr at once, unless quiet, and into the JSON; a sentence that was said is not said again.
    void warn(const std::string& sentence);
    void warn(const std::vector<std::string>& sentences);

    /// The result: the table for people, or with --json the values with the warnings added. Standard output, unless a
    /// mesh or a model went there. With --quiet a table that only tells of a file written is left out.
    void print(const Report& report) { print(report.text(), report.json()); }
    void print(const std::string& text, Json object);

private:
    std::optional<RunContext> context_;
    std::vector<std::string> warnings_;
    std::vector<std::pair<std::string, std::vector<std::string>>> given_; ///< options with their values
    bool wrote_file_ = false;
    bool standard_output_taken_ = false; ///< by a mesh or a model
};

/// Refuses, before any work, an output that lies in no folder.
void check_folder_of(const std::string& path);

/// Refuses, before any work, a second output (`option`; empty: none) that goes where the first goes, or has no format
/// that we know.
void check_second_output(const std::string& option, const std::string& path, const std::string& first);

/// "x.ply: 8 vertices, 6 faces", and the counts.
void report_mesh_written(const Mesh& mesh, const std::string& path, Report& report);

/// A line on stderr.
void say(const std::string& line);
/// Texts that name something in the first folder name it in the second: files are made aside and moved later.
void show_folder_as(const std::string& made_in, const std::string& shown);

/// "3.2e-05 of the diagonal (0.0012 units)".
std::string distance_text(const MeshDistance& distance, double units);

/// Vertices of make_wavy_cube with so many quads along a side.
constexpr std::size_t wavy_cube_vertices(std::size_t resolution) { return 6 * resolution * resolution + 2; }

} // namespace filigree::cli
