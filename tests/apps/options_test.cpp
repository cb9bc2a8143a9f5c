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
        ok({"level", "cube.fil", "0", "-o", "driver.ply", "--quiet"});
    }
};

TEST_F(OptionTables, NoCommandWritesOverItsInput) {
    std::filesystem::create_symlink(path("cube.ply"), path("link.ply"));
    write("pull.json", "{}");
    const std::vector<std::vector<std::string>> runs = {
        {"strip", "cube.ply", "-o", "cube.ply"},
        {"level", "cube.fil", "0", "-o", "cube.fil"},
        {"deform", "cube.ply", "-o", "cube.ply", "--bend", "10"},
        {"deform", "cube.ply", "-o", "./cube.ply", "--bend", "10"},
        {"deform", "cube.ply", "-o", "link.ply", "--bend", "10"},
        {"deform", "cube.fil", "-o", "x.ply", "--bend", "10", "--pose", "cube.fil"},
        {"deform", "cube.ply", "-o", "pull.json", "--handles", "pull.json"},
        {"restore", "cube.fil", "--pose", "driver.ply", "-o", "driver.ply"},
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

TEST_F(OptionTables, WhatIsNoCommandIsRefusedBesideHelpAndVersionToo) {
    for (const std::vector<std::string>& words : {std::vector<std::string>{"stripp"},
                                                  {"stripp", "--help"},
                                                  {"--help", "stripp"},
                                                  {"stripp", "--version"},
                                                  {"--version", "stripp"},
                                                  {"help", "stripp"},
                                                  {"--man", "stripp"},
                                                  {"stripp", "cube.ply", "-o", "x.fil"}})
        fails(2, words, {"there is no command 'stripp'; did you mean 'strip'?", "filigree --help"});
    fails(2, {"NONSENSE", "--help"}, {"there is no command 'NONSENSE'", "'filigree --help' lists the commands"});
    fails(2, {"--nonsense"}, {"there is no option --nonsense"});
    EXPECT_EQ(ok({"help", "strip"}).out, ok({"strip", "--help"}).out);
    EXPECT_EQ(ok({"help"}).out, ok({"--help"}).out);
}

TEST_F(OptionTables, AnOptionThatCountsOnceIsRefusedWhenGivenTwice) {
    const std::vector<std::vector<std::string>> runs = {
        {"strip", "cube.ply", "-o", "x.fil", "--base", "50", "--base", "60"},
        {"strip", "cube.ply", "-o", "x.fil", "--base=50", "--base", "60"},
        {"strip", "cube.ply", "-o", "x.fil", "--output", "y.fil"},
        {"fracture", "cube.ply", "-o", "x.ply", "--pattern", "even", "--pattern", "slabs"},
        {"fracture", "cube.ply", "-o", "x.ply", "--pattern", "slabs", "--grain", "1,0,0", "--grain", "0,1,0"},
        {"render", "cube.ply", "-o", "x.png", "--camera", "1,2,3,4,5,6", "--camera", "7,8,9"},
        {"deform", "cube.ply", "-o", "x.ply", "--bend", "10", "--axis", "x", "--axis", "y"},
        {"sample", "cube.ply", "-o", "x.ply", "--spacing", "0.1", "--eye", "1,2,3", "--eye", "1,2,3"},
    };
    for (const std::vector<std::string>& run : runs)
        fails(2, run, {"is given twice; give it once", run[0] + " --help' lists the options"});
    ok({"deform", "cube.ply", "-o", "x.ply", "--bend", "10", "--bend", "20"}); // steps, one after the other
    ok({"info", "cube.ply", "--json", "--json"});
}

TEST_F(OptionTables, WrongOptionsAndValuesAreToldInOurWords) {
    const std::vector<std::string> strip = {"strip", "cube.ply", "-o", "x.fil"};
    const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    fails(2, with(strip, {"--bse", "300"}), {"there is no option --bse; did you mean --base?", "strip --help"});
    fails(2, with(strip, {"--vertices", "300"}), {"there is no option --vertices; did you mean --base?"});
    fails(2, with(strip, {"other.ply"}), {"'other.ply' is one argument too many"});
    fails(2, with(strip, {"--base"}), {"--base takes 1 value", "none is given"});
    fails(2, {"fracture", "cube.ply", "-o", "x.ply", "--at", "0,0"}, {"--at takes a point X,Y,Z", "2 numbers"});
    fails(2, {"fracture", "cube.ply", "-o", "x.ply", "--at", "0,0,q"}, {"--at", "'0,0,q' is not a number"});
    fails(2, {"fracture", "cube.ply", "-o", "x.ply", "--roughness", "5"}, {"'5' is not a number from 0 to 1"});
    fails(2, {"fracture", "cube.ply", "-o", "x.ply", "--pattern", "radiall"},
          {"'radiall' is not one of", "did you mean 'radial'?"});
    fails(2, {"sample", "cube.ply", "-o", "x.ply", "--spacing", "1", "--count", "5"}, {"exclude each other"});
}

TEST_F(OptionTables, AMeshInPlaceOfASceneIsToldOf) {
    fails(4, {"simulate", "cube.ply", "-o", "x.fil"}, {"cube.ply: is a mesh, not a scene", "docs/scenes.md"});
    fails(4, {"simulate", "cube.fil", "-o", "x.fil"}, {"cube.fil: is a model, not a scene"});
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
    EXPECT_EQ(commands, 23u);
    fails(2, {"--man", "swim"}, {"swim"});
}

} // namespace
