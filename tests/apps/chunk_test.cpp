// Works in chunks by many processes, some of which are killed: the same bytes as by one.
#include "apps/program.h"
#include "cases.h"
#include "threads.h"

#include "filigree/io/animation/point_cache.h"
#include "filigree/io/model/model_file.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>

using namespace filigree_test;
using namespace filigree;

namespace {

constexpr std::size_t kFrames = 40;

class Chunks : public Program {
protected:
    void SetUp() override {
        const Model model = strip(make_wavy_sphere({.resolution = 120}), {}, kOneThread).value().model;
        PoseSequence poses;
        for (std::size_t k = 0; k < kFrames; ++k) {
            Pose& pose = poses.frames.emplace_back();
            for (const Vec3f& p : driver_positions(model))
                pose.positions.emplace_back(p.x() + 0.3f * std::sin(0.2f * float(k) + p.y()), p.y(), p.z());
        }
        ASSERT_TRUE(write_model(model, poses, path("moving.fil"), kOneThread));
        ok({"restore", "moving.fil", "--frames", "-o", "serial.pc2"});
        serial_ = bytes_of(path("serial.pc2"));
    }
    std::vector<std::string> chunk(const std::string& which, const std::string& output = "shot.pc2") const {
        return {"restore", "moving.fil", "--frames", "-o", output, "--chunk", which};
    }
    /// Folders and temporary files of a shot that is not whole.
    std::size_t left_over() const {
        const std::vector<std::string> names = files();
        return std::size_t(std::ranges::count_if(
            names, [](const std::string& name) { return name.ends_with(".chunks") || name.starts_with(".filigree"); }));
    }

    std::string serial_;
};

} // namespace

TEST_F(Chunks, InAnyOrderTheyGiveTheSameBytesAsOneProcess) {
    write("shot.pc2", "what was there before");
    for (const int k : {3, 1, 7, 6, 2, 5}) {
        const Json said = json(chunk(std::to_string(k) + "/7"));
        EXPECT_FALSE(said["is_whole"]);
        EXPECT_FALSE(said["was_done"]);
        EXPECT_EQ(bytes_of(path("shot.pc2")), "what was there before") << "until all is there";
    }
    EXPECT_TRUE(json(chunk("2/7"))["was_done"]);
    const Json last = json(chunk("4/7"));
    EXPECT_TRUE(last["is_whole"]);
    EXPECT_EQ(last["chunks_done"], 7);
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_EQ(left_over(), 0u);
    // A scheduler that runs one once more does no harm.
    EXPECT_TRUE(json(chunk("5/7"))["was_done"]);
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_EQ(left_over(), 0u);
}

TEST_F(Chunks, ManyAtTheSameTimeAlsoTwiceTheSame) {
    const Ran ran = run_shell("for k in 1 2 3 4 5 6 3 1; do "
                              "\"$0\" restore moving.fil --frames -o shot.pc2 --quiet --chunk $k/6 & done; wait");
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(ran.err, "");
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_EQ(left_over(), 0u);
}

TEST_F(Chunks, KilledOnesAreRunAgain) {
    write("shot.pc2", "before");
    int killed = 0;
    for (int k = 0; k < 24; ++k) // whenever it strikes: before the plan, among the frames, at the end
        killed += run(chunk(std::to_string(1 + k % 3) + "/3"), "/dev/null", 0.004 * k, SIGKILL).code == -1;
    EXPECT_GT(killed, 3);
    if (!left_over()) return; // all of them came to their end
    for (const char* which : {"1/3", "2/3", "3/3"}) ok(chunk(which));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
}

TEST_F(Chunks, JobsAreNotMixed) {
    ok(chunk("1/3"));
    fails(8, chunk("2/4"), {"shot.pc2.chunks", "another job"});
    fails(8, {"restore", "moving.fil", "--frames", "-o", "shot.pc2", "--level", "1", "--chunk", "2/3"},
          {"another job"});
    for (const char* which : {"2/3", "3/3"}) ok(chunk(which));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    // Once it is whole, another one may begin.
    ok(chunk("1/2"));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_TRUE(json(chunk("2/2"))["is_whole"]);
    EXPECT_EQ(left_over(), 0u);
}

TEST_F(Chunks, MoreChunksThanFramesAndOtherInputs) {
    for (int k = 1; k <= 50; ++k) ok(chunk(std::to_string(k) + "/50"));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    for (const char* wrong : {"0/3", "4/3", "3", "a/b", "1/", "-1/3", "1/3x"}) fails(2, chunk(wrong), {"K/N"});
    fails(2, chunk("1/3", "frames/"), {".pc2"});
    fails(2, chunk("1/3", "shot.mdd"), {".pc2"});
    fails(2, {"restore", "moving.fil", "--frame", "1", "-o", "a.ply", "--chunk", "1/2"}, {"--chunk"});
    fails(6, chunk("1/3", "no/such/folder/shot.pc2"), {"cannot be written"});
}

namespace {

/// Pictures and tables, whose items are files of their own.
class ChunkedItems : public Program {
protected:
    void SetUp() override {
        write("drop.toml",
              "[simulation]\nframes = 3\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\nresolution = 8\n"
              "particles = 60\ndriver = 40\ncentre = [0, 0.7, 0]\n[[obstacle]]\nshape = \"ground\"\n");
        ok({"make", "bar", "-o", "bar.ply", "--resolution", "2"});
        std::filesystem::create_directory(path("a"));
        std::filesystem::create_directory(path("b"));
    }
    /// Its table is `folder`/t.csv, of 6 runs.
    static std::vector<std::string> sweep(const std::string& folder, const std::string& chunk = "") {
        return with_chunk({"sweep", "drop.toml", "-o", folder + "/t.csv", "--set", "body.young_modulus=1e5,2e5,3e5",
                           "--set", "simulation.mode=auto,explicit", "--check"},
                          chunk);
    }
    /// Its pictures are `folder`/p_1.png to p_5.png.
    static std::vector<std::string> pictures(const std::string& folder, const std::string& chunk = "") {
        return pictures_of("5", folder, chunk);
    }
    static std::vector<std::string> pictures_of(const std::string& frames, const std::string& folder,
                                                const std::string& chunk) {
        return with_chunk({"render", "bar.ply", "-o", folder + "/p_%d.png", "--turntable", "--frames", frames, "--size",
                           "32x32", "--passes", "1"},
                          chunk);
    }
    bool has_opengl() const {
        std::filesystem::create_directory(path("tried"));
        return run(pictures_of("1", "tried", "")).code != 5;
    }

    /// Every file in a folder, with a hash of its bytes, but for the plans.
    std::map<std::string, std::size_t> all_in(const std::string& folder) const {
        std::map<std::string, std::size_t> all;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(path(folder)))
            if (entry.is_regular_file() && entry.path().extension() != ".plan")
                all[std::filesystem::relative(entry.path(), path(folder)).string()] =
                    std::hash<std::string>()(bytes_of(entry.path()));
        return all;
    }
    /// Any of `folder`'s parts in any order, each twice.
    void in_any_order(const std::function<std::vector<std::string>(const std::string&, const std::string&)>& words,
                      std::size_t items) const {
        ok(words("b", ""));
        for (const char* which : {"3/4", "1/4", "4/4", "1/4", "3/4"}) {
            EXPECT_FALSE(json(words("a", which))["is_whole"]);
            for (const auto& [name, bytes] : all_in("a"))
                EXPECT_NE(name.find(".chunks/"), std::string::npos) << name << ": in its place before all is there";
        }
        EXPECT_EQ(json(words("a", "1/4"))["made"], 0);
        const Json last = json(words("a", "2/4"));
        EXPECT_TRUE(last["is_whole"]);
        EXPECT_EQ(last["done"], items);
        EXPECT_EQ(all_in("a"), all_in("b"));
        EXPECT_EQ(json(words("a", "2/4"))["made"], 0) << "it is finished";
        EXPECT_EQ(all_in("a"), all_in("b"));
    }

private:
    static std::vector<std::string> with_chunk(std::vector<std::string> words, const std::string& chunk) {
        if (!chunk.empty()) words.insert(words.end(), {"--chunk", chunk});
        return words;
    }
};

} // namespace

TEST_F(ChunkedItems, ASweepInAnyOrderIsTheSameTable) {
    in_any_order(sweep, 6);
    const std::string table = bytes_of(path("a/t.csv"));
    EXPECT_EQ(std::ranges::count(table, '\n'), 7);
    EXPECT_TRUE(table.starts_with("run,scene,body.young_modulus,simulation.mode,body,"));
    EXPECT_NE(table.find("\n6,drop.toml,3e5,explicit,cube,"), std::string::npos) << table;
}

TEST_F(ChunkedItems, PicturesInAnyOrderAreTheSame) {
    if (!has_opengl()) GTEST_SKIP() << "no OpenGL";
    in_any_order(pictures, 5);
}

TEST_F(ChunkedItems, PicturesOfAKilledBatchDoNotComeBack) {
    if (!has_opengl()) GTEST_SKIP() << "no OpenGL";
    ok(pictures("a", "1/1"));
    const auto whole = all_in("a");
    std::filesystem::create_directories(path("a/.filigree-killed-placing/new"));
    write("a/.filigree-killed-placing/lock", "");
    write("a/.filigree-killed-placing/new/" + whole.begin()->first, "of the killed one");
    EXPECT_EQ(json(pictures("a", "1/1"))["made"], 0) << "it is finished";
    EXPECT_EQ(all_in("a"), whole);
    EXPECT_FALSE(std::filesystem::exists(path("a/.filigree-killed-placing")));
}

TEST_F(ChunkedItems, WhatIsThereIsKeptWithOtherNumbersOfChunksToo) {
    ok(sweep("b"));
    EXPECT_EQ(json(sweep("a", "1/2"))["made"], 3);
    EXPECT_EQ(json(sweep("a", "2/3"))["made"], 1) << "the fourth; the third was there";
    EXPECT_EQ(json(sweep("a", "1/1"))["made"], 2);
    EXPECT_EQ(all_in("a"), all_in("b"));
}

TEST_F(ChunkedItems, JobsAreNotMixedButMayFollow) {
    ok(sweep("a", "1/3"));
    std::vector<std::string> other = sweep("a", "2/3");
    other[5] = "body.young_modulus=1e5,2e5,4e5";
    fails(8, other, {"t.csv.chunks", "another job"});
    write("drop.toml", bytes_of(path("drop.toml")) + "friction = 0.1\n");
    fails(8, sweep("a", "2/3"), {"another job"});
    std::filesystem::remove_all(path("a/t.csv.chunks"));
    for (const char* which : {"1/3", "2/3", "3/3"}) ok(sweep("a", which));
    ok(sweep("b"));
    EXPECT_EQ(all_in("a"), all_in("b"));
    write("drop.toml", bytes_of(path("drop.toml")) + "restitution = 0.1\n");
    for (const char* which : {"1/3", "2/3", "3/3"}) ok(sweep("a", which));
    ok(sweep("b"));
    EXPECT_EQ(all_in("a"), all_in("b")) << "the older table is replaced";
}

TEST_F(ChunkedItems, ManyAtTheSameTime) {
    ok(sweep("b"));
    std::string line;
    for (const char* which : {"1/3", "2/3", "3/3", "1/3", "2/3", "3/3"})
        line += std::string("\"$0\" \"$@\" --quiet --chunk ") + which + " & ";
    const Ran ran = run_shell("{ " + line + "wait; }", sweep("a"));
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(ran.err, "");
    EXPECT_EQ(all_in("a"), all_in("b"));
}

TEST_F(ChunkedItems, SweepsSayWhatIsWrongBeforeTheySimulate) {
    const auto wrong = [](const std::string& set) {
        return std::vector<std::string>{"sweep", "drop.toml", "-o", "a/t.csv", "--set", set};
    };
    fails(4, wrong("body.young_modulus=1e5,-1"), {"run 2 of the sweep", "young_modulus", "-1"});
    fails(4, wrong("body.yung=1"), {"body.yung", "no such key"});
    fails(4, wrong("body[2].density=900"), {"the scene has 1 [[body]]"});
    fails(4, wrong("force.newtons=[1,2,3]"), {"the scene has no [[force]]"});
    fails(4, wrong("body.young_modulus=\"soft"), {"no value"});
    fails(2, wrong("young_modulus=1"), {"TABLE.KEY=VALUE"});
    fails(2, wrong("body[0].density=1"), {"body[0]"});
    fails(5, {"sweep", "drop.toml", "-o", "a/t.txt"}, {".csv"});
    fails(3, {"sweep", "no.toml", "-o", "a/t.csv"}, {"no.toml"});
    EXPECT_TRUE(all_in("a").empty());
    ok(wrong("body.velocity=[0,1,0],[0,2,0]"));
    EXPECT_NE(bytes_of(path("a/t.csv")).find("\n2,drop.toml,\"[0,2,0]\",cube"), std::string::npos);
}

/// A process is killed before its calls that change a file or a folder: before each from where the new begins to take
/// the place of the old, before every sixth until then (before each with FILIGREE_ALL_CASES).
class KilledEverywhere : public ChunkedItems {
protected:
    void SetUp() override {
        if (kSanitized) GTEST_SKIP() << "a sanitizer wants to be loaded first";
        ChunkedItems::SetUp();
        const Ran made =
            run_shell("cc -shared -fPIC -O1 -o shim.so \"$1\" -ldl", {FILIGREE_ROOT "/tests/torture/failing_calls.c"});
        if (made.code != 0) GTEST_SKIP() << "no C compiler: " << made.err;
    }

    /// words: a command for a folder and a chunk; `older` is finished in a before, and not to be lost. The other half
    /// is there already.
    void kill_everywhere(const std::function<std::vector<std::string>(const std::string&, const std::string&)>& words,
                         const std::vector<std::string>& older) {
        ok(words("b", ""));
        const auto whole = all_in("b");
        ok(older);
        const auto old = in_place("a");
        ASSERT_NE(old, whole);
        ok(words("a", "1/2"));
        namespace fs = std::filesystem;
        fs::copy(path("a"), path("begun"), fs::copy_options::recursive);
        int kills = 0;
        for (int number = 1, step = all_cases() ? 1 : 6;; number += step) {
            fs::remove_all(path("a"));
            fs::copy(path("begun"), path("a"), fs::copy_options::recursive);
            const Ran ran = run_shell("FAILING_CALL=any FAILING_HOW=kill FAILING_NUMBER=" + std::to_string(number) +
                                          " LD_PRELOAD=./shim.so exec \"$0\" \"$@\"",
                                      words("a", "2/2"));
            if (ran.code == 0 && step == 1) break;
            ASSERT_TRUE(ran.code == 0 || ran.code == -1) << ran.err;
            const auto shown = in_place("a");
            const bool is_being_placed = has_batch("a"); // which the next run completes, see io/system/file_batch.h
            EXPECT_TRUE(shown == old || shown == whole || is_being_placed) << "killed before call " << number;
            if (ran.code == 0) {
                ASSERT_EQ(shown, whole);
            }
            if (step > 1 &&
                (shown != old || is_being_placed)) { // begun: back to behind the last call before which it was old
                number -= step;
                step = 1;
                continue;
            }
            ok(words("a", "2/2"));
            ASSERT_EQ(all_in("a"), whole) << "killed before call " << number;
            ++kills;
        }
        EXPECT_EQ(all_in("a"), whole);
        EXPECT_GT(kills, 8);
        std::printf("killed before %d calls\n", kills);
    }

private:
    std::map<std::string, std::size_t> in_place(const std::string& folder) const {
        std::map<std::string, std::size_t> all = all_in(folder);
        std::erase_if(all, [](const auto& file) {
            return file.first.find(".chunks") != std::string::npos || file.first.starts_with(".filigree");
        });
        return all;
    }
    bool has_batch(const std::string& folder) const {
        return std::ranges::any_of(std::filesystem::directory_iterator(path(folder)), [](const auto& entry) {
            return entry.path().filename().string().ends_with("-placing");
        });
    }
};

TEST_F(KilledEverywhere, ATableIsTheOldOrTheNew) {
    std::vector<std::string> older = sweep("a", "1/1");
    older[7] = "simulation.mode=explicit,auto";
    kill_everywhere(sweep, older);
}

TEST_F(KilledEverywhere, PicturesAreTheOldOrTheNew) {
    if (!has_opengl()) GTEST_SKIP() << "no OpenGL";
    const auto few = [](const std::string& folder, const std::string& chunk) {
        return pictures_of(all_cases() ? "5" : "2", folder, chunk);
    };
    std::vector<std::string> older = few("a", "1/1");
    older.insert(older.end(), {"--color", "#ff0000"});
    kill_everywhere(few, older);
}

TEST_F(KilledEverywhere, AShotIsTheOldOrTheNew) {
    ok({"make", "wavy-sphere", "-o", "ball.ply", "--resolution", "20"});
    ok({"strip", "ball.ply", "-o", "ball.fil", "--base", "60"});
    ok({"deform", "ball.fil", "-o", "moving.fil", "--bend", "50", "--frames", "4"});
    const auto restore = [](const std::string& model) {
        return [model](const std::string& folder, const std::string& chunk) {
            std::vector<std::string> words = {"restore", model, "--frames", "-o", folder + "/shot.pc2"};
            if (!chunk.empty()) words.insert(words.end(), {"--chunk", chunk});
            return words;
        };
    };
    ok({"deform", "ball.fil", "-o", "other.fil", "--bend", "20", "--frames", "4"}); // a shot of the same size
    kill_everywhere(restore("moving.fil"), restore("other.fil")("a", "1/1"));
}
