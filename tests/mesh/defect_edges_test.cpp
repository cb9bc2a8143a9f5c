#include "filigree/mesh/defect_edges.h"

#include "filigree/mesh.h"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

using namespace filigree;

TEST(DefectEdges, AreThoseThatTheReportCounts) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}};
    for (const auto& face : {std::array<Index, 3>{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}) mesh.add_face(face);
    const std::vector<DefectEdge> edges = defect_edges(mesh);
    ASSERT_EQ(edges.size(), 7u);
    EXPECT_EQ(std::count_if(edges.begin(), edges.end(), [](const DefectEdge& e) { return e.is_open; }), 6);
    EXPECT_FALSE(edges[0].is_open);
    EXPECT_EQ(edges[0].b, 1u);
    EXPECT_TRUE(defect_edges(make_shape("bar", {}).value()).empty());

    // A face turned over, and one that is a line: marked where the report counts them.
    Mesh sheet;
    sheet.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 0, 0}};
    for (const auto& face : {std::array<Index, 3>{0, 1, 2}, {1, 2, 3}, {0, 1, 4}}) sheet.add_face(face);
    const std::vector<DefectEdge> marks = defect_edges(sheet);
    const TopologyReport report = analyse_topology(sheet, RunContext());
    const auto count = [&](auto is_it) {
        return static_cast<std::size_t>(std::count_if(marks.begin(), marks.end(), is_it));
    };
    EXPECT_EQ(report.inconsistent_edges.count, 2u);
    EXPECT_EQ(report.degenerate_faces.count, 1u);
    EXPECT_EQ(count([](const DefectEdge& e) { return e.is_opposed; }), report.inconsistent_edges.count);
    EXPECT_EQ(count([](const DefectEdge& e) { return e.is_open; }), report.open_edges.count);
    EXPECT_EQ(count([](const DefectEdge& e) { return e.a == e.b; }), report.degenerate_faces.count);
}
