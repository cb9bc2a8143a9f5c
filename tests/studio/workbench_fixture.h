// A workbench without a window, for tests of what a user can do.
#pragma once

#include "studio/first_state_once.h"

#include <QTemporaryDir>

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filigree::studio {

/// A workbench with what it told, and a folder for files.
class WorkbenchTest : public testing::Test {
protected:
    WorkbenchTest() {
        QObject::connect(&bench, &Workbench::told, &bench,
                         [this](const QString& sentence, bool is_error, const QString& action) {
                             (is_error ? errors : notes).push_back(sentence.toStdString());
                             offers.push_back(action.toStdString());
                         });
        QObject::connect(&bench, &Workbench::opened, &bench, [this] { ++opened; });
    }

    std::string path(const std::string& name) const { return (folder.path() + '/').toStdString() + name; }
    const State& state() const { return bench.state(); }
    QUndoStack& undo_stack() { return bench.document().undo_stack(); }

    void bend(double degrees) {
        Warps warps;
        warps.bend = degrees;
        bench.set_warps(warps);
    }
    /// A shape with so few vertices that bodies are made and moved in no time.
    void make_small_shape() {
        Shape shape = *state().shape;
        shape.options.resolution = 12;
        bench.make_shape(shape);
        bench.wait_until_idle();
        BodySettings body = state().body;
        body.particles = 200;
        bench.set_body(body);
        undo_stack().clear();
    }
    void pull_top(const Vec3d& way, int moves = 5) {
        const std::vector<Vec3f>& p = state().model->mesh.positions;
        const Index top =
            Index(std::max_element(p.begin(), p.end(), [](auto& a, auto& b) { return a.y() < b.y(); }) - p.begin());
        const Vec3d at = state().model->mesh.world_position(top);
        bench.begin_pull(top, at);
        for (int k = 1; k <= moves; ++k) bench.pull_to(at + double(k) / moves * way);
    }
    void simulate(std::size_t frames) {
        bench.make_body();
        bench.wait_until_idle();
        bench.play();
        bench.playback().wait_for_frames(frames);
        bench.pause();
    }

    Workbench bench{first_state_once()};
    std::vector<std::string> errors, notes, offers; ///< an offer comes with each of the others
    int opened = 0;
    QTemporaryDir folder;
};

} // namespace filigree::studio
