// A monkey at the window, and what it did taken back.
#include "cases.h"
#include "monkey.h"

#include <cstdlib>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

/// How many steps: fewer where a sanitizer makes each a hundred times dearer.
int step_count() {
#if defined(__SANITIZE_THREAD__)
    return 50;
#else
    return all_cases() ? 400 : 100;
#endif
}

TEST(RandomActions, ThreadsSurviveThem) {
    MainWindow window(false);
    window.viewport().set_passes(kPasses);
    window.resize(900, 620);
    window.show();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(&window));
    window.workbench().make_shape({.name = "wavy-cube", .options = {.resolution = 16}});
    window.workbench().wait_until_idle();

    const char* const seed = std::getenv("FILIGREE_SEED");
    Monkey monkey(window, seed ? static_cast<unsigned>(std::atoi(seed)) : 7);
    QStringList done;
    for (int i = 0; i < step_count(); ++i) {
        done << monkey.act();
        QCoreApplication::processEvents(QEventLoop::AllEvents, 20);
        const State& state = window.workbench().state();
        ASSERT_NE(state.model, nullptr) << done.join(", ").toStdString();
        ASSERT_LE(state.level(), state.model->finest_level()) << done.join(", ").toStdString();
        if (const Pose* pose = window.workbench().pose()) {
            ASSERT_EQ(pose->positions.size(), state.model->driver().vertices.size()) << done.join(", ").toStdString();
        }
    }
    window.workbench().wait_until_idle();

    // Whatever it did can be taken back and done again, to the byte.
    Document& document = window.workbench().document();
    window.workbench().pause();
    window.workbench().wait_until_idle();
    const State last = document.state();
    const int steps = document.undo_stack().index();
    while (document.undo_stack().canUndo()) document.undo_stack().undo();
    while (document.undo_stack().index() < steps) document.undo_stack().redo();
    EXPECT_TRUE(document.state() == last) << done.join(", ").toStdString();
}

} // namespace
