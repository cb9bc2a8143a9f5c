#include "filigree/pose.h"

#include "filigree/mesh.h"
#include "threads.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <numbers>

namespace filigree {
namespace {

struct Body {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;
};

/// A closed bar along x, 4 long and 1 thick, centred on the origin.
Body make_body(unsigned resolution) {
    const Mesh mesh = make_bar({.resolution = resolution});
    return {mesh.positions, triangulate(mesh).triangles};
}

std::vector<Index> select(const Body& body, const std::function<bool(const Vec3f&)>& wanted) {
    std::vector<Index> found;
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        if (wanted(body.positions[i])) found.push_back(static_cast<Index>(i));
    return found;
}

std::vector<Index> both_ends(const Body& body) {
    const double end = bounds(body.positions).max.x() - 1e-3;
    return select(body, [&](const Vec3f& p) { return std::abs(p.x()) > end; });
}

std::vector<Vec3f> at(
    const Body& body, std::span<const Index> handles,
    const std::function<Vec3f(const Vec3f&)>& motion = [](const Vec3f& p) { return p; }) {
    std::vector<Vec3f> targets;
    for (const Index handle : handles) targets.push_back(motion(body.positions[handle]));
    return targets;
}

Mat3f rotation(double degrees, const Vec3d& axis) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()).toRotationMatrix().cast<float>();
}

/// Ends of the bar turned by half of `degrees` each about z, placed where an arc of the bar's length ends.
std::function<Vec3f(const Vec3f&)> bent_ends(const Body& body, double degrees) {
    const double length = bounds(body.positions).size().x(), half = degrees * std::numbers::pi / 360;
    const double radius = length / (2 * half);
    return [=](const Vec3f& p) {
        const double side = p.x() < 0 ? -1 : 1;
        const Vec3f centre(static_cast<float>(side * radius * std::sin(half)),
                           static_cast<float>(radius * (1 - std::cos(half))), 0);
        const Vec3f in_section(0, p.y(), p.z());
        return Vec3f(centre + rotation(side * degrees / 2, Vec3d::UnitZ()) * in_section);
    };
}

HandleSolver make_solver(const Body& body, std::span<const Index> handles) {
    Result<HandleSolver> solver = HandleSolver::create(body.positions, body.triangles, handles, RunContext(1));
    EXPECT_TRUE(solver.ok());
    return std::move(solver).value();
}

void expect_proper(const Pose& pose) {
    for (const Vec3f& p : pose.positions) ASSERT_TRUE(p.allFinite());
    for (const Mat3f& R : pose.gradients) {
        ASSERT_LT((R.transpose() * R - Mat3f::Identity()).norm(), 1e-5f);
        ASSERT_GT(R.determinant(), 0.9f);
    }
}

/// The energy of [Sorkine 2007] and [Levi 2015], worked out anew from the cotangents.
double energy(const Body& body, const Pose& pose, double smoothness) {
    const double length = smoothness * bounds(body.positions).diagonal();
    std::map<std::pair<Index, Index>, double> weights;
    for (const Triangle& t : body.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = t[(k + 1) % 3], b = t[(k + 2) % 3];
            const Vec3d apex = body.positions[t[k]].cast<double>();
            const Vec3d u = body.positions[a].cast<double>() - apex, v = body.positions[b].cast<double>() - apex;
            weights[std::minmax(a, b)] += 0.5 * u.dot(v) / u.cross(v).norm();
        }
    double sum = 0;
    for (const auto& [edge, weight] : weights)
        for (const auto& [i, j] : {edge, std::pair(edge.second, edge.first)}) {
            const Vec3d now = (pose.positions[i] - pose.positions[j]).cast<double>();
            const Vec3d rest = (body.positions[i] - body.positions[j]).cast<double>();
            sum += std::max(weight, 0.0) * (now - pose.gradients[i].cast<double>() * rest).squaredNorm();
            const Mat3d turn = (pose.gradients[i] - pose.gradients[j]).cast<double>();
            sum += std::max(weight, 0.0) * 0.5 * length * length * turn.squaredNorm();
        }
    return sum;
}

double largest_difference(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, static_cast<double>((a[i] - b[i]).norm()));
    return largest;
}

TEST(Handles, HandlesAtRestLeaveEverythingAtRest) {
    const Body body = make_body(6);
    const std::vector<Index> handles = both_ends(body);
    HandleSolver solver = make_solver(body, handles);
    const auto result = solver.solve(at(body, handles), {}, RunContext(1));
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->iterations, 1u);
    EXPECT_LT(largest_difference(result->pose.positions, body.positions), 1e-6);
    for (const Mat3f& R : result->pose.gradients) EXPECT_LT((R - Mat3f::Identity()).norm(), 1e-6f);
}

TEST(Handles, RigidMotionsAreExact) {
    const Body body = make_body(6);
    const std::vector<Index> all_ends = both_ends(body),
                             one_end = select(body, [](const Vec3f&p) { return p.x() < -1.9f; });
    for (const auto& handles : {all_ends, one_end})
        for (const double degrees : {0.0, 1.0, 90.0, 179.9, 180.0, 270.0})
            for (const Vec3d& axis : {Vec3d(0, 0, 1), Vec3d(1, 0, 0), Vec3d(1, -2, 3)}) {
                HandleSolver solver = make_solver(body, handles);
                const Mat3f R = rotation(degrees, axis);
                const Vec3f shift(3, -1, 0.5);
                const auto motion = [&](const Vec3f& p) { return Vec3f(R * p + shift); };
                const auto result = solver.solve(at(body, handles, motion), {}, RunContext(1));
                ASSERT_TRUE(result.ok());
                EXPECT_LE(result->iterations, 3u);
                for (std::size_t i = 0; i < body.positions.size(); ++i) {
                    ASSERT_LT((result->pose.positions[i] - motion(body.positions[i])).norm(), 1e-5f) << degrees;
                    ASSERT_LT((result->pose.gradients[i] - R).norm(), 1e-5f) << degrees;
                }
            }
}

TEST(Handles, OneHandleAndTwoHandlesMoveRigidly) {
    const Body body = make_body(4);
    const std::vector<Index> one = {5};
    HandleSolver single = make_solver(body, one);
    const auto moved =
        single.solve(at(body, one, [](const Vec3f& p) { return Vec3f(p + Vec3f(1, 2, 3)); }), {}, RunContext(1));
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        ASSERT_LT((moved->pose.positions[i] - body.positions[i] - Vec3f(1, 2, 3)).norm(), 1e-5f);

    // Two handles leave the turn about their line open; every rigid motion that fits them has no strain.
    const std::vector<Index> two = {0, static_cast<Index>(body.positions.size() - 1)};
    HandleSolver pair = make_solver(body, two);
    const Mat3f R = rotation(120, {1, 1, 0});
    const auto turned = pair.solve(at(body, two, [&](const Vec3f& p) { return Vec3f(R * p); }), {}, RunContext(1));
    expect_proper(turned->pose);
    EXPECT_LT(energy(body, turned->pose, 0), 1e-8);
}

TEST(Handles, EnergyNeverRises) {
    const Body body = make_body(6);
    const std::vector<Index> handles = both_ends(body);
    const std::vector<Vec3f> targets = at(body, handles, bent_ends(body, 120));
    for (const double smoothness : {0.0, 0.03, 0.3}) {
        HandleSolver solver = make_solver(body, handles);
        double before = std::numeric_limits<double>::infinity(), first = 0;
        for (int round = 0; round < 60; ++round) {
            const auto result =
                solver.solve(targets, {.iterations = 1, .tolerance = 0, .smoothness = smoothness}, RunContext(1));
            const double now = energy(body, result->pose, smoothness);
            EXPECT_LE(now, before * (1 + 1e-5)) << round; // positions come back in float
            if (round == 0) first = now;
            before = now;
        }
        EXPECT_LT(before, 0.9 * first);
    }
}

TEST(Handles, MomentumGetsFurtherThanPlainRounds) {
    const Body body = make_body(8);
    const std::vector<Index> handles = both_ends(body);
    const std::vector<Vec3f> targets = at(body, handles, bent_ends(body, 90));
    HandleSolver plain = make_solver(body, handles), momentum = make_solver(body, handles);
    Pose after_plain;
    for (int round = 0; round < 50; ++round) // a solve of one round has no momentum
        after_plain = plain.solve(targets, {.iterations = 1, .tolerance = 0}, RunContext(1))->pose;
    double before = std::numeric_limits<double>::infinity();
    for (const unsigned rounds : {1u, 2u, 5u, 10u, 20u, 50u}) {
        momentum.reset();
        const auto result = momentum.solve(targets, {.iterations = rounds, .tolerance = 0}, RunContext(1));
        const double now = energy(body, result->pose, HandleOptions{}.smoothness);
        EXPECT_LT(now, before);
        before = now;
    }
    EXPECT_LT(before, energy(body, after_plain, HandleOptions{}.smoothness));
}

/// How a section of the bar across x turned about z (degrees), and where its centre went.
struct Section {
    double angle = 0;
    Vec3d centre = Vec3d::Zero();
};

Section section_at(const Body& body, const Pose& pose, double x) {
    const std::vector<Index> vertices = select(body, [&](const Vec3f& p) { return std::abs(p.x() - x) < 1e-3; });
    EXPECT_FALSE(vertices.empty());
    Section section;
    const double share = 1 / static_cast<double>(vertices.size());
    for (const Index i : vertices) {
        const Mat3f& R = pose.gradients[i];
        section.angle += share * std::atan2(R(1, 0), R(0, 0)) * 180 / std::numbers::pi;
        section.centre += share * pose.positions[i].cast<double>();
    }
    return section;
}

TEST(Handles, BentBarIsAnArcAtAnyResolution) {
    for (const unsigned resolution : {4u, 8u, 12u}) {
        const Body body = make_body(resolution);
        const std::vector<Index> handles = both_ends(body);
        HandleSolver solver = make_solver(body, handles);
        const auto result = solver.solve(at(body, handles, bent_ends(body, 90)), {.iterations = 2000}, RunContext(2));
        ASSERT_TRUE(result.ok());
        expect_proper(result->pose);
        EXPECT_LE(result->last_move, 1e-5);
        const double radius = 8 / std::numbers::pi; // a quarter circle of length 4
        for (int quarter = -6; quarter <= 6; ++quarter) {
            const double x = 0.25 * quarter;
            const Section section = section_at(body, result->pose, x);
            EXPECT_NEAR(section.angle, 22.5 * x, 2) << x << ", " << resolution;
            EXPECT_NEAR((section.centre - Vec3d(0, radius, 0)).norm(), radius, 0.03) << x << ", " << resolution;
            const Section mirrored = section_at(body, result->pose, -x);
            EXPECT_NEAR(section.angle, -mirrored.angle, 0.1);
            EXPECT_NEAR(section.centre.x(), -mirrored.centre.x(), 1e-3);
            EXPECT_NEAR(section.centre.y(), mirrored.centre.y(), 1e-3);
            EXPECT_NEAR(section.centre.z(), 0, 1e-3);
        }
    }
}

TEST(Handles, ASecondSolveWithTheSameTargetsIsStable) {
    const Body body = make_body(6);
    const std::vector<Index> handles = both_ends(body);
    HandleSolver solver = make_solver(body, handles);
    const std::vector<Vec3f> targets = at(body, handles, bent_ends(body, 60));
    const auto first = solver.solve(targets, {.iterations = 2000, .tolerance = 1e-6}, RunContext(1));
    const auto second = solver.solve(targets, {.iterations = 2000, .tolerance = 1e-6}, RunContext(1));
    EXPECT_LE(second->iterations, 2u);
    EXPECT_LT(largest_difference(first->pose.positions, second->pose.positions), 1e-5);
    // And from rest again it is the first to the byte.
    solver.reset();
    const auto third = solver.solve(targets, {.iterations = 2000, .tolerance = 1e-6}, RunContext(1));
    EXPECT_EQ(first->pose.positions, third->pose.positions);
    EXPECT_EQ(first->iterations, third->iterations);
}

TEST(Handles, SameBytesForAnyThreadCount) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Body body = make_body(16);
    const std::vector<Index> handles = both_ends(body);
    const std::vector<Vec3f> targets = at(body, handles, bent_ends(body, 90));
    HandleSolver one = make_solver(body, handles), three = make_solver(body, handles);
    const auto a = one.solve(targets, {.iterations = 20}, RunContext(1));
    const auto b = three.solve(targets, {.iterations = 20}, RunContext(3));
    EXPECT_EQ(a->pose.positions, b->pose.positions);
    EXPECT_EQ(a->pose.gradients, b->pose.gradients);
}

TEST(Handles, ScaleAndPlaceDoNotMatter) {
    const Body body = make_body(5);
    const std::vector<Index> handles = both_ends(body);
    const std::vector<Vec3f> targets = at(body, handles, bent_ends(body, 90));
    HandleSolver solver = make_solver(body, handles);
    const auto plain = solver.solve(targets, {}, RunContext(1));
    for (const float scale : {0x1p-60f, 0x1p50f}) { // powers of two, so that rounding is the same
        Body scaled = body;
        for (Vec3f& p : scaled.positions) p *= scale;
        std::vector<Vec3f> scaled_targets = targets;
        for (Vec3f& p : scaled_targets) p *= scale;
        HandleSolver other = make_solver(scaled, handles);
        const auto result = other.solve(scaled_targets, {}, RunContext(1));
        EXPECT_EQ(result->iterations, plain->iterations);
        for (std::size_t i = 0; i < body.positions.size(); ++i)
            ASSERT_LT((result->pose.positions[i] / scale - plain->pose.positions[i]).norm(), 1e-6f);
    }
}

/// Adds a copy of `part`, moved, that shares nothing with the body.
void append(Body& body, const Body& part, const Vec3f& move) {
    const auto first = static_cast<Index>(body.positions.size());
    for (const Vec3f& p : part.positions) body.positions.push_back(p + move);
    for (const Triangle& t : part.triangles) body.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

TEST(Handles, PartsWithoutHandlesStayAtRest) {
    Body body = make_body(4);
    const std::size_t count = body.positions.size();
    const Body other = body;
    append(body, other, Vec3f(0, 5, 0));
    body.positions.emplace_back(9, 9, 9); // in no triangle at all
    const std::vector<Index> handles = select(body, [](const Vec3f& p) { return std::abs(p.x()) > 1.9f && p.y() < 2; });
    HandleSolver solver = make_solver(body, handles);
    const auto result = solver.solve(at(body, handles, bent_ends(other, 90)), {}, RunContext(1));
    for (std::size_t i = count; i < body.positions.size(); ++i) {
        EXPECT_EQ(result->pose.positions[i], body.positions[i]);
        EXPECT_EQ(result->pose.gradients[i], Mat3f::Identity());
    }
    EXPECT_GT((result->pose.positions[count / 2] - body.positions[count / 2]).norm(), 1e-3f);
}

TEST(Handles, EachPartFollowsItsOwnHandles) {
    Body body = make_body(4);
    const Body other = body;
    append(body, other, Vec3f(0, 5, 0));
    const std::vector<Index> handles = both_ends(body);
    const Mat3f R = rotation(130, {1, 2, 3});
    const auto motion = [&](const Vec3f& p) { return p.y() < 2 ? Vec3f(R * p) : Vec3f(R.transpose() * p); };
    HandleSolver solver = make_solver(body, handles);
    const auto result = solver.solve(at(body, handles, motion), {}, RunContext(1));
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        ASSERT_LT((result->pose.positions[i] - motion(body.positions[i])).norm(), 1e-5f);
}

TEST(Handles, AllVerticesPinned) {
    const Body body = make_body(3);
    const std::vector<Index> handles = select(body, [](const Vec3f&) { return true; });
    HandleSolver solver = make_solver(body, handles);
    const auto motion = [](const Vec3f& p) { return Vec3f(2 * p.x(), p.y(), -p.z()); };
    const auto result = solver.solve(at(body, handles, motion), {}, RunContext(1));
    EXPECT_EQ(result->pose.positions, at(body, handles, motion));
    expect_proper(result->pose);
}

TEST(Handles, HandlesAreExactlyWhereTheyAreAsked) {
    const Body body = make_body(5);
    const std::vector<Index> handles = {7, 3, 60, 11};
    const std::vector<Vec3f> targets = {{1, 2, 3}, {-1, 0, 0.1f}, {4, 4, 4}, {0, 0, 0}};
    HandleSolver solver = make_solver(body, handles);
    const auto result = solver.solve(targets, {}, RunContext(1));
    for (std::size_t h = 0; h < handles.size(); ++h) EXPECT_EQ(result->pose.positions[handles[h]], targets[h]);
}

TEST(Handles, CrushedFlattenedAndMirroredTargetsGiveProperRotations) {
    const Body body = make_body(5);
    const std::vector<Index> handles = select(body, [](const Vec3f& p) { return std::abs(p.x()) > 0.9f; });
    const std::vector<std::function<Vec3f(const Vec3f&)>> motions = {
        [](const Vec3f&) { return Vec3f(1, 1, 1); },
        [](const Vec3f& p) { return Vec3f(p.x(), p.y(), 0); },
        [](const Vec3f& p) { return Vec3f(p.x(), 0, 0); },
        [](const Vec3f& p) { return Vec3f(-p.x(), p.y(), p.z()); },
        [](const Vec3f& p) { return Vec3f(-p); },
        [](const Vec3f& p) {
            return Vec3f(p.x() < 0 ? p : rotation(180, {1, 0, 0}) * p);
        },
    };
    for (std::size_t m = 0; m < motions.size(); ++m) {
        HandleSolver solver = make_solver(body, handles);
        for (int again = 0; again < 2; ++again) {
            const auto result = solver.solve(at(body, handles, motions[m]), {}, RunContext(1));
            ASSERT_TRUE(result.ok());
            expect_proper(result->pose);
        }
        // What was crushed comes back.
        const auto back = solver.solve(at(body, handles), {.iterations = 1000, .tolerance = 1e-7}, RunContext(1));
        expect_proper(back->pose);
        EXPECT_LT(energy(body, back->pose, 0), 1e-3) << m;
    }
}

TEST(Handles, DegenerateTrianglesAreHarmless) {
    Body body = make_body(4);
    const Index count = static_cast<Index>(body.positions.size());
    body.positions.push_back(body.positions[0]); // a duplicate, tied on by a triangle without area
    body.positions.push_back(0.5f * (body.positions[1] + body.positions[2])); // a T-junction
    body.triangles.push_back({0, count, 1});
    body.triangles.push_back({1, count + 1, 2});
    body.triangles.push_back({3, 3, 3});
    body.triangles.push_back({4, 4, 5});
    body.triangles.push_back(body.triangles[0]); // twice the same
    const std::vector<Index> handles = both_ends(make_body(4));
    HandleSolver solver = make_solver(body, handles);
    const Mat3f R = rotation(75, {1, 2, 3});
    const auto rigid = solver.solve(at(body, handles, [&](const Vec3f& p) { return Vec3f(R * p); }), {}, RunContext(1));
    expect_proper(rigid->pose);
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        ASSERT_LT((rigid->pose.positions[i] - R * body.positions[i]).norm(), 1e-5f) << i;
    const auto bent = solver.solve(at(body, handles, bent_ends(body, 90)), {}, RunContext(1));
    expect_proper(bent->pose);

    // Nothing but points in one place.
    const Body point = {std::vector<Vec3f>(4, Vec3f(1, 2, 3)), {{0, 1, 2}, {1, 2, 3}}};
    const std::vector<Index> first = {0};
    HandleSolver other = make_solver(point, first);
    const std::vector<Vec3f> target = {{5, 5, 5}};
    expect_proper(other.solve(target, {}, RunContext(1))->pose);
}

TEST(Handles, WrongInputIsNamed) {
    const Body body = make_body(3);
    const auto code = [&](std::vector<Index> handles) {
        return HandleSolver::create(body.positions, body.triangles, handles, RunContext(1)).error().code;
    };
    EXPECT_EQ(code({}), ErrorCode::usage);
    EXPECT_EQ(code({1, 2, 1}), ErrorCode::usage);
    EXPECT_EQ(code({static_cast<Index>(body.positions.size())}), ErrorCode::usage);

    const std::vector<Index> handles = {1, 2};
    HandleSolver solver = make_solver(body, handles);
    const std::vector<Vec3f> one = {{0, 0, 0}}, wild = {{0, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0}};
    EXPECT_EQ(solver.solve(one, {}, RunContext(1)).error().code, ErrorCode::mismatch);
    EXPECT_EQ(solver.solve(wild, {}, RunContext(1)).error().code, ErrorCode::usage);
}

TEST(Handles, FactoringIsCancelled) {
    const Body body = make_body(5);
    RunContext context(1);
    std::string phase;
    context.progress = [&](std::string_view name, double) {
        phase = name;
        context.cancel();
    };
    const auto solver = HandleSolver::create(body.positions, body.triangles, both_ends(body), context);
    EXPECT_EQ(phase, "factoring");
    ASSERT_FALSE(solver.ok());
    EXPECT_EQ(solver.error().code, ErrorCode::cancelled);
}

TEST(Handles, CancellingKeepsTheLastSolution) {
    const Body body = make_body(5);
    const std::vector<Index> handles = both_ends(body);
    HandleSolver cancelled = make_solver(body, handles), undisturbed = make_solver(body, handles);
    const std::vector<Vec3f> targets = at(body, handles, bent_ends(body, 90));
    RunContext context(1);
    context.progress = [&](std::string_view, double fraction) {
        if (fraction > 0.05) context.cancel();
    };
    EXPECT_EQ(cancelled.solve(targets, {}, context).error().code, ErrorCode::cancelled);
    const auto a = cancelled.solve(targets, {}, RunContext(1)), b = undisturbed.solve(targets, {}, RunContext(1));
    EXPECT_EQ(a->pose.positions, b->pose.positions);
}

} // namespace
} // namespace filigree
