// Random actions on one mesh after another, while files are damaged, disks are full and the window closes at any
// moment. FILIGREE_SOAK_MINUTES: how long (scripts/soak-studio; unset: one round, three with FILIGREE_ALL_CASES).
// FILIGREE_SEED: the first round.
#include "cases.h"
#include "monkey.h"
#include "threads.h"

#include "filigree/file.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"

#include <QElapsedTimer>
#include <QTemporaryDir>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include <gtest/gtest.h>
#include <sys/resource.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

namespace fs = std::filesystem;

std::string bytes_in(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
}
void write_bytes(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

/// No file may grow beyond this, as on a full disk, for as long as it stands.
class FullDisk {
public:
    explicit FullDisk(rlim_t bytes) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit small{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &small);
    }
    ~FullDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

private:
    rlimit before_{};
};

class StudioSoak : public testing::Test {
protected:
    void SetUp() override {
        Mesh dirty = make_wavy_cube({.resolution = 10});
        dirty.positions.push_back({5, 5, 5}); // in no face
        dirty.positions[3] = dirty.positions[4];
        (void)write_mesh(dirty, at("dirty.obj"), {}, kOneThread).value();
        (void)write_mesh(make_wavy_sphere({.resolution = 40}), at("ball.ply"), {}, kOneThread).value();
        (void)write_mesh(make_wavy_plane({.resolution = 30}), at("plane.obj"), {}, kOneThread).value();
        const Model torus = strip(make_torus({.resolution = 40}), {.base = 120}, kOneThread).value().model;
        (void)write_model(torus, at("torus.fil"), kOneThread).value();
        for (const char* name : kFiles) originals_.push_back(bytes_in(at(name)));
    }
    fs::path at(const std::string& name) const { return fs::path(folder_.path().toStdString()) / name; }

    /// One window's life, cut short where its time is over. Returns how many things were done in it.
    int round(unsigned seed, const std::function<bool()>& has_time) {
        for (std::size_t k = 0; k < kFiles.size(); ++k) write_bytes(at(kFiles[k]), originals_[k]);
        auto window = std::make_unique<MainWindow>(false);
        window->viewport().set_passes(kPasses);
        window->resize(700, 500);
        window->show();
        Workbench& workbench = window->workbench();
        Monkey monkey(*window, seed);
        done_ = {QStringLiteral("seed %1").arg(seed)};
        workbench.open(at(kFiles[monkey.below(kFiles.size())]).string());
        if (monkey.below(2)) workbench.wait_until_idle();
        const int most = 20 + int(monkey.below(120));
        int count = 0;
        for (; count < most && has_time(); ++count) {
            done_ << (monkey.below(8) ? monkey.act() : mishap(workbench, monkey));
            QCoreApplication::processEvents(QEventLoop::AllEvents, 10);
            expect_sound(workbench);
            if (HasFatalFailure()) return count;
        }
        if (monkey.below(2)) { // else it closes whatever is at work
            workbench.pause();
            workbench.wait_until_idle();
            expect_taken_back(workbench);
        }
        return count;
    }

    static constexpr std::array<const char*, 4> kFiles = {"ball.ply", "plane.obj", "dirty.obj", "torus.fil"};

    QString mishap(Workbench& workbench, Monkey& monkey) {
        const char* const name = kFiles[monkey.below(kFiles.size())];
        switch (monkey.below(6)) {
        case 0:
            workbench.open(at(name).string());
            return QStringLiteral("open %1").arg(name);
        case 1:
            damage(at(name), monkey);
            return QStringLiteral("damage %1").arg(name);
        case 2: { // and opened while it is written
            damage(at(name), monkey);
            workbench.open(at(name).string());
            damage(at(name), monkey);
            return QStringLiteral("open damaged %1").arg(name);
        }
        case 3:
            workbench.save_model("/dev/full");
            return "save to /dev/full";
        case 4:
            workbench.save_mesh(at("no/such/folder/mesh.ply").string());
            return "save to no folder";
        default:
            return save_on_full_disk(workbench, monkey);
        }
    }

    void damage(const fs::path& path, Monkey& monkey) {
        std::string bytes = bytes_in(path);
        for (unsigned times = 1 + monkey.below(8); times > 0 && !bytes.empty(); --times)
            bytes[monkey.below(bytes.size())] = char(monkey.below(256));
        if (monkey.below(3) == 0) bytes.resize(monkey.below(bytes.size() + 1));
        write_bytes(path, bytes);
    }

    /// What was there is there afterwards, or the whole new model.
    QString save_on_full_disk(Workbench& workbench, Monkey& monkey) {
        const fs::path path = at("saved.fil");
        write_bytes(path, originals_.back());
        {
            const FullDisk disk(monkey.below(60'000));
            workbench.save_model(path.string());
            workbench.pause();
            workbench.wait_until_idle();
        }
        const std::string there = bytes_in(path);
        EXPECT_TRUE(there == originals_.back() || read_model(there, "saved.fil", kOneThread))
            << done_.join(", ").toStdString();
        return "save on a full disk";
    }

    void expect_sound(Workbench& workbench) {
        const State& state = workbench.state();
        ASSERT_NE(state.model, nullptr) << done_.join(", ").toStdString();
        ASSERT_LE(state.level(), state.model->finest_level()) << done_.join(", ").toStdString();
        if (const Pose* pose = workbench.pose()) {
            ASSERT_EQ(pose->positions.size(), state.model->driver().vertices.size()) << done_.join(", ").toStdString();
        }
    }

    void expect_taken_back(Workbench& workbench) {
        Document& document = workbench.document();
        const State last = document.state();
        const int steps = document.undo_stack().index();
        while (document.undo_stack().canUndo()) document.undo_stack().undo();
        while (document.undo_stack().index() < steps) document.undo_stack().redo();
        EXPECT_TRUE(document.state() == last) << done_.join(", ").toStdString();
    }

    QTemporaryDir folder_;
    std::vector<std::string> originals_; ///< of kFiles
    QStringList done_;
};

TEST_F(StudioSoak, AFullDiskIsToldOf) {
    MainWindow window(false);
    window.viewport().set_passes(kPasses);
    Workbench& workbench = window.workbench();
    workbench.open(at("ball.ply").string());
    workbench.wait_until_idle();
    QString told;
    bool was_error = false;
    QObject::connect(&workbench, &Workbench::told, [&](const QString& sentence, bool is_error) {
        told = sentence;
        was_error = is_error;
    });
    {
        const FullDisk disk(1000);
        workbench.save_model(at("torus.fil").string());
        workbench.wait_until_idle();
    }
    EXPECT_TRUE(was_error);
    EXPECT_TRUE(told.contains("torus.fil")) << told.toStdString();
    EXPECT_EQ(bytes_in(at("torus.fil")), originals_.back());
}

TEST_F(StudioSoak, ThreadsSurviveIt) {
    const char* const minutes = std::getenv("FILIGREE_SOAK_MINUTES");
    const char* const first = std::getenv("FILIGREE_SEED");
    const unsigned seed = first ? unsigned(std::atoi(first)) : 1;
    QElapsedTimer time;
    time.start();
    unsigned rounds = 0;
    long actions = 0;
    const auto goes_on = [&] {
        return minutes ? double(time.elapsed()) < 60e3 * std::atof(minutes) : rounds < (all_cases() ? 3u : 1u);
    };
    int tried = 0;
    const auto has_time = [&] { return minutes ? goes_on() : all_cases() || ++tried <= 40; };
    for (; goes_on() && !HasFailure(); ++rounds) {
        actions += round(seed + rounds, has_time);
        if (minutes)
            std::printf("window of seed %u: ended after %.1f minutes\n", seed + rounds, double(time.elapsed()) / 60e3);
        std::fflush(stdout);
    }
    std::printf("soak: %u windows, %ld actions, %.1f minutes, %s\n", rounds, actions, double(time.elapsed()) / 60e3,
                HasFailure() ? "broken" : "whole");
}

} // namespace
