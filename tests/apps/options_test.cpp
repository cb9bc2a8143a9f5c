// The tables of options: what no command may do, whatever its options, and the manual pages made from them.
#include "apps/program.h"

#include <map>

using namespace filigree_test;

namespace {

class OptionTables : public Program {
protected:
    OptionTables() {
        ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "8", "--quiet"});
        ok({"strip", "cube.ply", "-o", "cube.fil", "--base", "50", "--quiet"});
        ok({"level", "cube.fil", "0", "-o", "driver.ply", "--ghosts", "ghosts.ply", "--quiet"});
    }
};

TEST_F(OptionTables, NoCommandWritesOverItsInput) {
    std::filesystem::create_symlink(path("cube.ply"), path("link.ply"));
    write("pull.json", "{}");
    const std::vector<std::vector<std::string>> runs = {
        {"strip", "cube.ply", "-o", "cube.ply"},
        {"level", "cube.fil", "0", "-o", "cube.fil"},
        {"level", "cube.fil", "0", "-o", "x.ply", "--ghosts", "cube.fil"},
        {"deform", "cube.ply", "-o", "cube.ply", "--bend", "10"},
        {"deform", "cube.ply", "-o", "./cube.ply", "--bend", "10"},
        {"deform", "cube.ply", "-o", "link.ply", "--bend", "10"},
        {"deform", "cube.fil", "-o", "x.ply", "--bend", "10", "--pose", "cube.fil"},
        {"deform", "cube.ply", "-o", "pull.json", "--handles", "pull.json"},
        {"restore", "cube.fil", "--pose", "driver.ply", "-o", "driver.ply"},
        {"restore", "cube.fil", "--pose", "driver.ply", "--ghosts", "ghosts.ply", "-o", "ghosts.ply"},
        {"restore", "cube.fil", "--pose", "driver.ply", "-o", "x.ply", "--picture", "driver.ply"},
        {"compare", "cube.ply", "driver.ply", "--picture", "driver.ply"},
        {"sample", "cube.ply", "-o", "cube.ply", "--count", "100"},
        {"sample", "cube.ply", "-o", "x.ply", "--count", "100", "--picture", "cube.ply"},
        {"remesh", "cube.ply", "-o", "cube.ply"},
        {"remesh", "cube.ply", "-o", "x.ply", "--base", "cube.ply"},
        {"render", "driver.ply", "cube.ply", "-o", "cube.ply"},
        {"render", "driver.ply", "-o", "cube.ply", "--scalar", "error", "--against", "cube.ply"},
        {"export", "cube.fil", "-o", "cube.fil"},
        {"pack", "cube.fil", "-o", "cube.fil"},
        {"unpack", "cube.fil", "-o", "cube.fil"},
    };
    std::map<std::string, std::string> before;
    for (const std::string& name : files()) before[name] = bytes_of(path(name));
    for (const std::vector<std::string>& run : runs) fails(2, run, {"is the input and would be overwritten"});
    for (const std::string& name : files()) EXPECT_EQ(bytes_of(path(name)), before[name]) << name;
}

TEST_F(OptionTables, ManualPagesNameEveryOption) {
    const std::string help = ok({"--help"}).out, page = ok({"--man"}).out;
    EXPECT_TRUE(page.starts_with(".TH FILIGREE 1")) << page.substr(0, 80);
    std::istringstream lines(help.substr(help.find("Subcommands:\n") + 13));
    std::size_t commands = 0;
    for (std::string line; std::getline(lines, line) && line.starts_with("  ");) {
        const std::string command = line.substr(2, line.find(' ', 2) - 2);
        SCOPED_TRACE(command);
        ++commands;
        EXPECT_NE(page.find("\\fB" + command + "\\fR"), std::string::npos);
        const std::string of_command = ok({"--man", command}).out;
        std::istringstream options(ok({command, "--help"}).out);
        for (std::string option; std::getline(options, option);) {
            const std::size_t at = option.find("--");
            if (!option.starts_with("  -") || at == std::string::npos || option.find("--help") != std::string::npos)
                continue;
            std::string name = option.substr(at, option.find(' ', at) - at), escaped;
            for (const char c : name) escaped += c == '-' ? "\\-" : std::string(1, c);
            EXPECT_NE(of_command.find("\\fB" + escaped + "\\fR"), std::string::npos) << name;
        }
    }
    EXPECT_EQ(commands, 19u);
    fails(2, {"--man", "swim"}, {"swim"});
}

} // namespace
