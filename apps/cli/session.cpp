#include "session.h"

#include "filigree/io/file.h"
#include "filigree/io/model_file.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <unistd.h>

namespace filigree::cli {

namespace {

const RunContext* cancel_target = nullptr; // what Ctrl-C stops; set once, before the handler

void on_interrupt(int) {
    cancel_target->cancel();
    std::signal(SIGINT, SIG_DFL); // a second one ends the program at once
}

/// A bar that is drawn over itself, at most ten times a second.
class ProgressBar {
public:
    ~ProgressBar() { clear(); }
    void draw(std::string_view phase, double fraction) {
        const double now = now_seconds();
        if (now - start_ < 0.5 || (now - last_ < 0.1 && fraction < 1)) return; // short work needs no bar
        last_ = now;
        constexpr int kWidth = 30;
        const int full = static_cast<int>(fraction * kWidth);
        fmt::print(stderr, "\r{:<12} [{}{}] {:3.0f} %", phase, std::string(full, '#'), std::string(kWidth - full, '.'),
                   100 * fraction);
        std::fflush(stderr);
        drawn_ = true;
    }
    void clear() {
        if (drawn_) fmt::print(stderr, "\r{:<60}\r", "");
        drawn_ = false;
    }

private:
    double start_ = now_seconds(), last_ = 0;
    bool drawn_ = false;
};

} // namespace

double now_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void Session::add_common_options(CLI::App& command, const std::string& examples) {
    command.add_flag("--json", json, "Print the result as JSON");
    command.add_option("--threads", threads, "Threads to use; 0 for all (results never depend on it)")
        ->check(CLI::Range(0, 1024));
    command.add_flag("--quiet", quiet, "No progress bar, no warnings");
    command.footer("Examples:\n" + examples);
}

void Session::begin() {
    context_.emplace(threads);
    if (!quiet && isatty(STDERR_FILENO))
        context_->progress = [bar = std::make_shared<ProgressBar>()](std::string_view phase, double fraction) {
            bar->draw(phase, fraction);
            if (fraction >= 1) bar->clear();
        };
    cancel_target = &*context_;
    std::signal(SIGINT, on_interrupt);
}

void Session::warn(const std::string& sentence) {
    if (!quiet) fmt::print(stderr, "filigree: warning: {}\n", sentence);
    warnings_.push_back(sentence);
}

Mesh Session::read_mesh(const std::string& path) {
    MeshFile file = require(filigree::read_mesh(path, context()));
    for (const std::string& warning : file.warnings) warn(warning);
    return std::move(file.mesh);
}

Model Session::read_model(const std::string& path) { return require(filigree::read_model(path, context())); }

std::variant<Mesh, Model> Session::read_any(const std::string& path) {
    const std::string bytes = require(read_file(path));
    if (is_model_file(bytes)) return require(filigree::read_model(bytes, path, context()));
    MeshFile file = require(filigree::read_mesh(bytes, path, context()));
    for (const std::string& warning : file.warnings) warn(warning);
    return std::move(file.mesh);
}

void Session::write_mesh(const Mesh& mesh, const std::string& path) {
    standard_output_taken_ |= path == "-";
    if (path == "-") { // no name to tell the format by: PLY holds the most
        std::string bytes;
        for (const std::string& warning : require(filigree::write_mesh(mesh, MeshFormat::ply, bytes))) warn(warning);
        const std::string_view piece = bytes;
        require(write_file(path, std::span(&piece, 1)));
        return;
    }
    for (const std::string& warning : require(filigree::write_mesh(mesh, path, context()))) warn(warning);
}

void Session::print(const std::string& text, Json object) {
    std::FILE* out = standard_output_taken_ ? stderr : stdout;
    if (json) {
        object["warnings"] = warnings_;
        fmt::print(out, "{}\n", object.dump(2, ' ', false, Json::error_handler_t::replace));
    } else if (!quiet) {
        fmt::print(out, "{}", text);
    }
}

std::string Table::text() const {
    std::size_t width = 0;
    for (const auto& [name, value] : rows_) width = std::max(width, name.size());
    std::string text;
    for (const auto& [name, value] : rows_) text += fmt::format("{:<{}}  {}\n", name, width, value);
    return text;
}

std::string with_commas(std::size_t count) {
    std::string digits = std::to_string(count);
    for (std::size_t at = digits.size(); at > 3;) digits.insert(at -= 3, ",");
    return digits;
}

std::string distance_text(double units, double diagonal) {
    return fmt::format("{:.2e} of the diagonal ({:.3g} units)", diagonal > 0 ? units / diagonal : 0.0, units);
}

std::string seconds_text(double seconds) {
    if (seconds < 1e-3) return fmt::format("{:.3g} us", seconds * 1e6);
    if (seconds < 1) return fmt::format("{:.3g} ms", seconds * 1e3);
    return fmt::format("{:.3g} s", seconds);
}

} // namespace filigree::cli
