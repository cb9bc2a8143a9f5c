// What is drawn while the document is another already.
#include "stage.h"
#include "viewport.h"

#include <QTest>
#include <QWidget>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

constexpr int kPatience = 20'000; // ms

TEST(Stage, AModelWithMoreLevelsThanTheOneDrawn) {
    Workbench workbench;
    workbench.make_shape({.name = "wavy-cube", .options = {.resolution = 16}});
    workbench.wait_until_idle();
    workbench.set_strip({.levels = 1});
    workbench.wait_until_idle();
    Viewport viewport(workbench);
    viewport.resize(360, 240);
    viewport.set_animated(false);
    viewport.show();
    const auto is_ready = [&] { return viewport.is_ready(); };
    ASSERT_TRUE(QTest::qWaitFor(is_ready, kPatience));

    workbench.set_strip({.levels = 4});
    workbench.wait_until_idle();
    ASSERT_EQ(workbench.state().level(), 4u);
    viewport.show_all(); // of the old model
    ViewSettings settings = workbench.view().settings();
    settings.split = settings.clip = true;
    workbench.view().set(settings);
    ASSERT_TRUE(QTest::qWaitFor([&] { return is_ready() && viewport.timings().level == 4; }, kPatience));

    ShownModel nothing_ready(workbench.state(), RestoreOn::cpu);
    EXPECT_FALSE(nothing_ready.nearest_ready(1'000));
    EXPECT_EQ(nothing_ready.level(1'000), nullptr);
}

} // namespace
