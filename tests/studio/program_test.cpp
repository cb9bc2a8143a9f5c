// The program as a user starts it: options, scripts, screenshots, exit codes.
#include "filigree/render.h"

#include <QProcess>
#include <QTemporaryDir>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

#include <gtest/gtest.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

class Program : public testing::Test {
protected:
    struct Ran {
        int code;
        std::string errors, output = {};
    };
    /// without: a variable that the program does not see.
    Ran run(const QStringList& words, const QString& without = {}) {
        QProcess process;
        QProcessEnvironment environment = QProcessEnvironment::systemEnvironment();
        environment.remove(without);
        process.setProcessEnvironment(environment);
        process.setWorkingDirectory(folder_.path());
        process.start(FILIGREE_STUDIO, words);
        if (!process.waitForFinished(300'000)) return {-1, "it does not end"};
        return {process.exitStatus() == QProcess::NormalExit ? process.exitCode() : -1,
                process.readAllStandardError().toStdString(), process.readAllStandardOutput().toStdString()};
    }
    fs::path file(const std::string& name) const { return fs::path(folder_.path().toStdString()) / name; }
    void write(const std::string& name, const std::string& text) const { std::ofstream(file(name)) << text; }

    QTemporaryDir folder_;
};

/// How many different colours a picture has: a window that was not drawn has few.
std::size_t color_count(const Picture& picture) {
    std::set<std::uint32_t> colors;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
        colors.insert(picture.rgba[i] | picture.rgba[i + 1] << 8 | picture.rgba[i + 2] << 16);
    return colors.size();
}

TEST_F(Program, SavesAScreenshotOfTheSizeAskedFor) {
    const Ran ran = run({"--screenshot", "window.png", "--size", "700x520", "--panel", "detail"});
    ASSERT_EQ(ran.code, 0) << ran.errors;
    const Result<Picture> picture = read_picture(file("window.png"));
    ASSERT_TRUE(picture.ok()) << picture.error().message;
    EXPECT_EQ(picture->width, 700u);
    EXPECT_EQ(picture->height, 520u);
    EXPECT_GT(color_count(*picture), 500u);
}

TEST_F(Program, PullsSavesAndExportsByAScript) {
    write("tour.txt", "# a pull, and what comes of it\n"
                      "set model.resolution 16\nwait\n"
                      "panel deform\nset deform.bend 40\nexpect deform.bend 40\n"
                      "drag 0.5 0.5 0.7 0.35\nwait\n"
                      "save pulled.fil\nsave_mesh pulled.obj\nsave_driver driver.ply\n"
                      "do edit.undo\ndo edit.undo\nexpect deform.bend 0\n"
                      "screenshot \"after the pull.png\"\n");
    const Ran ran = run({"--script", "tour.txt", "--size", "700x520"});
    ASSERT_EQ(ran.code, 0) << ran.errors;
    for (const char* name : {"pulled.fil", "pulled.obj", "driver.ply", "after the pull.png"})
        EXPECT_TRUE(fs::exists(file(name))) << name;
}

TEST_F(Program, SimulatesFramesForAScreenshot) {
    const Ran ran = run({"--screenshot", "body.png", "--panel", "body", "--frames", "3", "--size", "700x520"});
    ASSERT_EQ(ran.code, 0) << ran.errors;
    EXPECT_TRUE(fs::exists(file("body.png")));
}

TEST_F(Program, NamesTheLineOfAScriptThatFails) {
    write("wrong.txt", "panel view\n\ndo view.sideways\n");
    const Ran ran = run({"--script", "wrong.txt"});
    EXPECT_EQ(ran.code, 2) << ran.errors;
    EXPECT_NE(ran.errors.find("wrong.txt:3: there is no action 'view.sideways'"), std::string::npos) << ran.errors;
}

TEST_F(Program, ScriptsTryAndDoNotWait) {
    write("try.txt", "try open \"no such.obj\"\nexpect message \"no such.obj\"\nscreenshot now.png now\n"
                     "set model.frequency 999\n");
    const Ran ran = run({"--script", "try.txt", "--size", "900x620"});
    EXPECT_EQ(ran.code, 2) << ran.errors;
    EXPECT_NE(ran.errors.find("try.txt:4: 999 is out of range"), std::string::npos) << ran.errors;
    EXPECT_TRUE(fs::exists(file("now.png")));
}

TEST_F(Program, RefusesWhatMakesNoSense) {
    EXPECT_EQ(run({"--screenshot", "a.png", "--size", "big"}).code, 2);
    EXPECT_EQ(run({"--screenshot", "a.png", "--panel", "kitchen"}).code, 2);
    EXPECT_EQ(run({"--screenshot", "a.png", "--frames", "-1"}).code, 2);
    EXPECT_EQ(run({"--script", "no such.txt"}).code, 3);
    EXPECT_FALSE(fs::exists(file("a.png")));
}

TEST_F(Program, NamesWhatScriptsCanName) {
    const Ran ran = run({"--names"});
    EXPECT_EQ(ran.code, 0) << ran.errors;
    for (const char* name :
         {"detail.remove", "body.animate", "edit.undo", "deform.bend", "view.zoom", "timeline.scrub"})
        EXPECT_NE(ran.output.find(std::string("  ") + name + ' '), std::string::npos) << name;
}

TEST_F(Program, SaysThatThereIsNoScreen) {
    const Ran ran = run({"--screenshot", "a.png"}, "DISPLAY");
    EXPECT_EQ(ran.code, 5);
    EXPECT_NE(ran.errors.find("There is no screen"), std::string::npos) << ran.errors;
    EXPECT_EQ(std::count(ran.errors.begin(), ran.errors.end(), '\n'), 1) << ran.errors;
    EXPECT_EQ(run({"--help"}, "DISPLAY").code, 0);
}

TEST_F(Program, SaysThatThereIsNoOpenGl) {
    const Ran ran = run({"--platform", "offscreen", "--screenshot", "a.png"}, "DISPLAY");
    EXPECT_EQ(ran.code, 5);
    EXPECT_NE(ran.errors.find("no OpenGL"), std::string::npos) << ran.errors;
}

TEST_F(Program, SaysWhatIsWrongWithAFile) {
    write("broken.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n");
    const Ran ran = run({"broken.obj", "--screenshot", "a.png"});
    EXPECT_EQ(ran.code, 4);
    EXPECT_NE(ran.errors.find("broken.obj:3"), std::string::npos) << ran.errors;
    EXPECT_FALSE(fs::exists(file("a.png")));
}

} // namespace
