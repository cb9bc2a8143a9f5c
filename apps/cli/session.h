// What every command shares: its common options, reading and writing, warnings, progress, output.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/io/mesh_file.h"

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
    /// Makes the context when the options are known; from here on Ctrl-C cancels.
    void begin();
    const RunContext& context() const { return *context_; }

    Mesh read_mesh(const std::string& path);
    Model read_model(const std::string& path);
    /// A mesh or a model, told by the content.
    std::variant<Mesh, Model> read_any(const std::string& path);
    void write_mesh(const Mesh& mesh, const std::string& path);

    /// Goes to stderr at once, unless quiet, and into the JSON.
    void warn(const std::string& sentence);

    /// The result: `text` for people, or with --json `object` with the warnings added.
    void print(const std::string& text, Json object);

private:
    std::optional<RunContext> context_;
    std::vector<std::string> warnings_;
    bool standard_output_taken_ = false; ///< by a mesh or a model
};

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
std::string distance_text(double units, double diagonal);
/// Seconds with three digits that matter.
std::string seconds_text(double seconds);

double now_seconds(); ///< a monotonic clock

// One command each, in the file of its name.
void add_make(CLI::App& app, Session& session);
void add_info(CLI::App& app, Session& session);
void add_strip(CLI::App& app, Session& session);
void add_level(CLI::App& app, Session& session);
void add_deform(CLI::App& app, Session& session);
void add_restore(CLI::App& app, Session& session);
void add_compare(CLI::App& app, Session& session);
void add_bench(CLI::App& app, Session& session);
void add_demo(CLI::App& app, Session& session);

} // namespace filigree::cli
