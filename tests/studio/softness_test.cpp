// Softness that is painted: kept, undone, saved, and felt by the body.
#include "coloring.h"
#include "softness.h"
#include "viewport_stand.h"
#include "workbench_fixture.h"

#include "filigree/file.h"

namespace filigree::studio {
namespace {

TEST_F(WorkbenchTest, PaintedSoftnessIsOneStepAndComesBackFromFiles) {
    make_small_shape();
    const Mesh& mesh = state().source->mesh;
    const double radius = 0.3 * bounds(mesh.positions).diagonal();
    bench.paint_softness(0, radius, false);
    bench.paint_softness(1, radius, false);
    bench.end_painting();
    EXPECT_EQ(undo_stack().count(), 1);
    const auto softness = softness_of(state());
    ASSERT_TRUE(softness);
    EXPECT_EQ((*softness)[0], 1);
    std::size_t untouched = 0;
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
        EXPECT_TRUE((*softness)[v] >= 0 && (*softness)[v] <= 1);
        const bool is_far = (mesh.positions[v] - mesh.positions[0]).norm() > radius &&
                            (mesh.positions[v] - mesh.positions[1]).norm() > radius;
        untouched += is_far && (*softness)[v] == 0;
    }
    EXPECT_GT(untouched, mesh.vertex_count() / 3);
    bench.paint_softness(0, 1e-6, true);
    bench.end_painting();
    EXPECT_EQ((*softness_of(state()))[0], 0);
    undo_stack().undo();

    for (const char* const name : {"soft.fil", "soft.ply"}) {
        if (std::string(name).ends_with(".fil"))
            bench.save_model(path(name));
        else
            bench.save_mesh(path(name));
        bench.wait_until_idle();
        const std::vector<float> before = *softness_of(state());
        bench.open(path(name));
        bench.wait_until_idle();
        ASSERT_TRUE(errors.empty()) << errors[0];
        ASSERT_TRUE(softness_of(state())) << name;
        EXPECT_EQ(*softness_of(state()), before) << name;
    }
    // Another mesh has none of it.
    Shape shape;
    shape.options.resolution = 9;
    bench.make_shape(shape);
    bench.wait_until_idle();
    EXPECT_FALSE(softness_of(state()));
}

TEST_F(WorkbenchTest, ABodyIsSoftWhereThatIsPainted) {
    make_small_shape();
    const Mesh& mesh = state().source->mesh;
    const auto softest_of = [&] {
        bench.make_body();
        bench.wait_until_idle();
        const auto& fields = bench.playback().made()->body->fields.stiffness;
        return fields.empty() ? 1.0f : *std::ranges::min_element(fields);
    };
    EXPECT_EQ(softest_of(), 1.0f);
    std::vector<float> half(mesh.vertex_count()); // the left half
    for (Index v = 0; v < half.size(); ++v) half[v] = mesh.positions[v].x() < 0;
    bench.set_softness(std::make_shared<const std::vector<float>>(half));
    bench.end_painting();
    EXPECT_EQ(offers.back(), "body.make");
    EXPECT_NEAR(softest_of(), 0.1, 0.02);
    BodySettings body = state().body;
    body.softest = 0.3;
    bench.set_body(body);
    bench.wait_until_idle();
    EXPECT_NEAR(*std::ranges::min_element(bench.playback().made()->body->fields.stiffness), 0.3, 0.02);
    body.preset = "steel";
    body.material.model = MaterialModel::rigid;
    bench.set_body(body);
    bench.wait_until_idle();
    EXPECT_NE(bench.body_warning().toStdString().find("Finite elements"), std::string::npos);
}

TEST(Soften, TheBrushPaintsWhatIsUnderTheMouse) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.tool = &kSoftenTool; });
    const QPoint from = stand.middle(), to = from + QPoint(30, 0);
    const auto there = stand.viewport->pick(from);
    ASSERT_TRUE(there);
    stand.drag(from, to);
    ASSERT_TRUE(softness_of(stand.workbench.state()));
    EXPECT_EQ((*softness_of(stand.workbench.state()))[there->vertex], 1);
    EXPECT_EQ(stand.workbench.view().settings().coloring, &kSoftnessColors);
    EXPECT_EQ(stand.workbench.document().undo_stack().count(), stand.workbench.document().undo_stack().index());
    stand.workbench.document().undo_stack().undo();
    EXPECT_FALSE(softness_of(stand.workbench.state())) << "a stroke is one step";
    stand.press(from); // called off
    stand.move(from, to);
    QTest::keyClick(stand.viewport, Qt::Key_Escape);
    EXPECT_FALSE(softness_of(stand.workbench.state()));
    stand.release(to);
}

} // namespace
} // namespace filigree::studio
