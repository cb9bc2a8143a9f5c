#include "session.h"

#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/platform.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

const RunContext* cancel_target = nullptr;           // what Ctrl-C stops; set once, before the handler
volatile std::sig_atomic_t is_waiting_for_input = 0; // where nothing looks at the cancel flag

void on_interrupt(int signal) {
    if (is_waiting_for_input) {
        constexpr std::string_view kLine = "filigree: Cancelled; nothing was written.\n";
        platform::write(platform::kStandardError, kLine);
        platform::end_process(static_cast<int>(ErrorCode::cancelled));
    }
    cancel_target->cancel();
    if (signal == SIGINT) std::signal(SIGINT, SIG_DFL); // a second Ctrl-C ends the program at once
}

/// Folders in which files are made aside, and those in which they will be: all texts name the latter.
std::vector<std::pair<std::string, std::string>>& shown_folders() {
    static std::vector<std::pair<std::string, std::string>> folders;
    return folders;
}
std::string with_shown_folders(std::string text) {
    for (const auto& [made_in, shown] : shown_folders())
        for (std::size_t at = text.find(made_in); at != std::string::npos; at = text.find(made_in, at + shown.size()))
            text.replace(at, made_in.size(), shown);
    return text;
}

/// To stderr, whole and at once. When nobody can read it, nothing is lost that matters.
void write_text(const std::string& text) {
    std::fputs(with_shown_folders(text).c_str(), stderr);
    std::fflush(stderr);
}

/// What messages call a file.
std::string shown_name(const std::string& path) { return path == "-" ? "standard input" : path; }

/// A bar that is drawn over itself, at most ten times a second; in long phases with the time left.
class ProgressBar {
public:
    ~ProgressBar() { clear(); }
    void draw(std::string_view phase, double fraction) {
        const double now = now_seconds();
        if (phase != phase_) {
            phase_ = phase;
            phase_start_ = now;
        }
        if (now - start_ < 0.5 || (now - last_ < 0.1 && fraction < 1)) return; // short work needs no bar
        last_ = now;
        constexpr int kWidth = 30;
        const int full = static_cast<int>(fraction * kWidth);
        write_text(fmt::format("\r{:<14} [{}{}] {:3.0f} %{:<18}", phase, std::string(full, '#'),
                               std::string(kWidth - full, '.'), 100 * fraction, time_left(now, fraction)));
        drawn_ = true;
    }
    void clear() {
        if (drawn_) write_text(fmt::format("\r{:<70}\r", ""));
        drawn_ = false;
        phase_.clear();
    }

private:
    /// As if the rest went as the phase has gone so far; "" before that can be said.
    std::string time_left(double now, double fraction) const {
        const double gone = now - phase_start_;
        if (gone < 2 || fraction < 0.01) return "";
        const auto seconds = static_cast<long>(gone / fraction * (1 - fraction) + 0.5);
        if (seconds < 60) return fmt::format(", {} s left", seconds);
        return fmt::format(", {}:{:02} min left", seconds / 60, seconds % 60);
    }

    std::string phase_;
    double start_ = now_seconds(), phase_start_ = start_, last_ = 0;
    bool drawn_ = false;
};

/// The same where nobody can draw over a line, such as in a log: a line with an estimate after some seconds, then one a
/// tenth of the work, and not too many of them.
class ProgressLines {
public:
    void tell(std::string_view phase, double fraction) {
        constexpr double kFirst = 10, kNext = 10, kSilence = 300; // seconds
        const double now = now_seconds();
        if (phase != phase_) {
            phase_ = phase;
            phase_start_ = last_ = now;
            told_ = -1;
        }
        const double gone = now - phase_start_;
        if (told_ < 0 ? gone < kFirst || fraction < 0.005
                      : now - last_ < kNext || (fraction < told_ + 0.1 && now - last_ < kSilence))
            return;
        if (fraction >= 1) return;
        write_text(fmt::format("filigree: {}: {:.0f} % in {}, about {} left\n", phase, 100 * fraction, span(gone),
                               span(gone / fraction * (1 - fraction))));
        told_ = fraction;
        last_ = now;
    }

private:
    static std::string span(double seconds) {
        const auto whole = static_cast<long>(seconds + 0.5);
        if (whole < 60) return fmt::format("{} s", whole);
        if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
        return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
    }

    std::string phase_;
    double phase_start_ = 0, last_ = 0, told_ = -1;
};

} // namespace

OptionList Session::common_options() {
    return {Option("--json", json, "Print the result as JSON"),
            Option("--threads", threads, "Number of threads; 0: all. Results do not depend on it").between(0, 1024),
            Option("--quiet", quiet, "No progress, no warnings, no summary of written files")};
}

std::string Session::first_given(const std::vector<std::string>& options) const {
    for (const auto& [given, values] : given_)
        if (std::ranges::find(options, given) != options.end()) return given;
    return "";
}

std::string Session::settings_but(const std::vector<std::string>& options) const {
    std::string text;
    for (const auto& [given, values] : given_) {
        if (std::ranges::find(options, given) != options.end()) continue;
        text += given;
        for (const std::string& value : values) text += " '" + value + "'";
        text += '\n';
    }
    return text;
}

void Session::begin() {
    context_.emplace(threads);
    if (!quiet && !platform::is_terminal(platform::kStandardError))
        context_->progress = [lines = std::make_shared<ProgressLines>()](std::string_view phase, double fraction) {
            lines->tell(phase, fraction);
        };
    else if (!quiet)
        context_->progress = [bar = std::make_shared<ProgressBar>()](std::string_view phase, double fraction) {
            bar->draw(phase, fraction);
            if (fraction >= 1) bar->clear();
        };
    cancel_target = &*context_;
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
#if !defined(_WIN32)
    if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN); // under nohup
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN); // a file that may not grow fails like a full disk, and is removed
#endif
}

RunContext Session::silent_context() const {
    RunContext silent = context();
    silent.progress = nullptr;
    return silent;
}

void Session::warn(const std::string& sentence) {
    if (std::find(warnings_.begin(), warnings_.end(), sentence) != warnings_.end()) return;
    if (!quiet) say("filigree: warning: " + sentence);
    warnings_.push_back(sentence);
}

void Session::warn(const std::vector<std::string>& sentences) {
    for (const std::string& sentence : sentences) warn(sentence);
}

FileReader Session::open(const std::string& path) const {
    std::error_code ignored;
    is_waiting_for_input =
        path == "-" || !std::filesystem::is_regular_file(path_of(path), ignored); // a pipe, a terminal
    Result<FileReader> file = FileReader::open(path_of(path));
    is_waiting_for_input = 0;
    return require(std::move(file));
}

Mesh Session::parse_mesh(const std::string& bytes, const std::string& path) {
    MeshFile file = require(filigree::read_mesh(bytes, shown_name(path), context()));
    warn(file.warnings);
    return std::move(file.mesh);
}

Mesh Session::read_mesh(const std::string& path) {
    const FileReader file = open(path);
    if (is_model_file(file))
        refuse(ErrorCode::bad_file, shown_name(path) + ": is a model where a mesh belongs; "
                                                       "'filigree level MODEL 0 -o MESH' writes its driver.");
    return parse_mesh(require(file.read_all()), path);
}

FileReader Session::open_model(const std::string& path) const {
    FileReader file = open(path);
    if (!is_model_file(file))
        refuse(ErrorCode::bad_file,
               shown_name(path) + " is not a Filigree model: make one of a mesh with 'filigree strip'.");
    return file;
}

Model Session::read_model(const std::string& path, PoseSequence* poses) {
    return read_model(open_model(path), path, poses);
}

Model Session::read_model(const FileReader& file, const std::string& path, PoseSequence* poses) {
    if (poses) *poses = require(read_poses(file, shown_name(path), context()));
    return require(filigree::read_model(file, shown_name(path), context()));
}

Mesh Session::read_level(const FileReader& file, unsigned level, const std::string& path) const {
    const unsigned finest = unsigned(outline(file, path).levels.size()) - 1;
    if (level > finest) refuse(fmt::format("{}: has levels 0 to {}; there is no level {}.", path, finest, level));
    return require(read_model_level(file, level, shown_name(path), context()));
}

ModelOutline Session::outline(const FileReader& file, const std::string& path) const {
    return require(read_model_outline(file, shown_name(path), context()));
}

Session::Content Session::read_any(const FileReader& file, const std::string& path) {
    if (!is_model_file(file)) return {parse_mesh(require(file.read_all()), path), {}};
    return {require(filigree::read_model(file, shown_name(path), context())),
            require(read_poses(file, shown_name(path), context()))};
}

Session::Content Session::read_any(const std::string& path) { return read_any(open(path), path); }

void Session::begin_writing(const std::string& path) {
    if (context().is_cancelled()) throw Failure{cancelled_error()};
    wrote_file_ = true;
    standard_output_taken_ |= path == "-";
}

void Session::write_mesh(const Mesh& mesh, const std::string& path, const std::string& source) {
    begin_writing(path);
    WriteMeshOptions options;
    if (source != "-") options.materials_beside = path_of(source);
    if (path == "-") options.format = MeshFormat::ply; // no name to tell the format by: PLY holds the most
    warn(require(filigree::write_mesh(mesh, path_of(path), options, context())));
}

void Session::write_model(const Model& model, const std::string& path, const PoseSequence& poses) {
    begin_writing(path);
    require(filigree::write_model(model, poses, path_of(path), context()));
}

void Session::print(const std::string& text, Json object) {
    if (!wrote_file_ && context().is_cancelled()) throw Failure{cancelled_error()};
    if (!json && quiet && wrote_file_) return;
    object["warnings"] = warnings_;
    const std::string shown = with_shown_folders(json ? object.text() + "\n" : text);
    if (standard_output_taken_) return write_text(shown);
    if (std::fputs(shown.c_str(), stdout) == EOF || std::fflush(stdout) == EOF)
        refuse(ErrorCode::unwritable,
               "standard output: cannot be written: the reader has gone away, or the disk is full.");
}

void check_folder_of(const std::string& path) {
    std::error_code ignored;
    const std::filesystem::path folder = path_of(path).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder, ignored))
        refuse(ErrorCode::unwritable, path + ": cannot be written: there is no such folder.");
}

void check_second_output(const std::string& option, const std::string& path, const std::string& first) {
    if (path.empty()) return;
    if (path == first)
        refuse(option + " and -o both write to " + (path == "-" ? "standard output" : path) +
               "; give each a place of its own.");
    if (path != "-") require(mesh_format(path_of(path)));
}

void report_mesh_written(const Mesh& mesh, const std::string& path, Report& report) {
    report.say(fmt::format("{}: {} vertices, {} faces\n", path, with_commas(mesh.vertex_count()),
                           with_commas(mesh.face_count())));
    report.set("vertices", mesh.vertex_count());
    report.set("faces", mesh.face_count());
}

void show_folder_as(const std::string& made_in, const std::string& shown) {
    shown_folders().emplace_back(made_in, shown);
}

void say(const std::string& line) { write_text(line + "\n"); }

std::string distance_text(const MeshDistance& distance, double units) {
    return fmt::format("{:.2e} of the diagonal ({:.3g} units)", distance.relative(units), units);
}

} // namespace filigree::cli
