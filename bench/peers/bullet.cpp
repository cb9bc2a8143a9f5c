// Bullet: a solid cube of 20 x 20 x 20 nodes, held at one face and swinging under gravity, as tetrahedra of neo-Hookean
// matter and as a lattice of links; and 200 rigid pieces that fall into a heap. The scenes are those of
// `filigree bench simulate`.
#include "peer.h"

#include <cmath>
#include <memory>

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

namespace {

constexpr int kSide = 20;
constexpr btScalar kSpacing = btScalar(1) / (kSide - 1), kDensity = 1000, kFrame = btScalar(1) / 60;
constexpr btScalar kYoung = 1e6f, kPoisson = 0.3f;
const btVector3 kGravity(0, btScalar(-9.81), 0);

int node(int i, int j, int k) { return i + kSide * (j + kSide * k); }

std::unique_ptr<btSoftBody> make_nodes(btSoftBodyWorldInfo& info) {
    btAlignedObjectArray<btVector3> places;
    for (int k = 0; k < kSide; ++k)
        for (int j = 0; j < kSide; ++j)
            for (int i = 0; i < kSide; ++i)
                places.push_back(kSpacing * btVector3(btScalar(i), btScalar(j), btScalar(k)));
    auto body = std::make_unique<btSoftBody>(&info, places.size(), &places[0], nullptr);
    body->setActivationState(DISABLE_DEACTIVATION);
    body->m_cfg.collisions = 0;
    return body;
}

void hold_a_face(btSoftBody& body) {
    for (int k = 0; k < kSide; ++k)
        for (int j = 0; j < kSide; ++j) body.setMass(node(0, j, k), 0);
}

constexpr double kMostSag = 0.12; // m: of this cube 0.03 at rest, twice that when swinging; more is a body coming apart

/// How far the far face has sunk, m; NaN where the body came apart.
double sag(const btSoftBody& body) {
    const btVector3 held = body.m_nodes[node(0, 0, 0)].m_x, far = body.m_nodes[node(kSide - 1, 0, 0)].m_x;
    if (!(held.length() < 1e-5f)) peer::give_up("Bullet did not hold what it was told to hold");
    return std::abs(far.y()) < kMostSag ? double(-far.y()) : NAN;
}

/// Cells in six tetrahedra each: a path of edges from the lowest corner to the highest.
void add_tetrahedra(btSoftBody& body) {
    constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int k = 0; k + 1 < kSide; ++k)
        for (int j = 0; j + 1 < kSide; ++j)
            for (int i = 0; i + 1 < kSide; ++i)
                for (const auto& path : kPaths) {
                    int at[3] = {i, j, k}, corners[4] = {node(i, j, k)};
                    for (int step = 0; step < 3; ++step) {
                        ++at[path[step]];
                        corners[step + 1] = node(at[0], at[1], at[2]);
                    }
                    if ((path[1] - path[0] + 3) % 3 == 2) std::swap(corners[2], corners[3]); // an odd path
                    body.appendTetra(corners[0], corners[1], corners[2], corners[3]);
                }
    body.initializeDmInverse();
    body.m_tetraScratches.resize(body.m_tetras.size());
    body.m_tetraScratchesTn.resize(body.m_tetras.size());
}

/// ms a frame (median), or 0 where the body came apart.
double measure_neo_hookean(bool implicit, int substeps, int frames) {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btDeformableBodySolver bodies;
    btDeformableMultiBodyConstraintSolver constraints;
    constraints.setDeformableSolver(&bodies);
    btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &bodies);
    world.setGravity(kGravity);
    world.getWorldInfo().m_gravity = kGravity;
    world.setImplicit(implicit);
    world.setLineSearch(false);
    world.setUseProjection(true); // without it implicit steps move nothing

    const auto body = make_nodes(world.getWorldInfo());
    add_tetrahedra(*body);
    body->setVolumeMass(kDensity); // of 1 m^3
    hold_a_face(*body);
    btDeformableGravityForce gravity(kGravity);
    btDeformableNeoHookeanForce elasticity;
    elasticity.setYoungsModulus(kYoung);
    elasticity.setPoissonRatio(kPoisson);
    elasticity.setDamping(0);
    world.addSoftBody(body.get());
    world.addForce(body.get(), &gravity);
    world.addForce(body.get(), &elasticity);
    std::fprintf(stderr, "%d nodes, %d tetrahedra\n", body->m_nodes.size(), body->m_tetras.size());

    std::vector<double> times;
    for (int frame = 0; frame < frames; ++frame) {
        times.push_back(peer::seconds([&] { world.stepSimulation(kFrame, substeps, kFrame / btScalar(substeps)); }));
        if (!std::isfinite(sag(*body))) break;
    }
    const double sunk = sag(*body);
    world.removeForce(body.get(), &gravity);
    world.removeForce(body.get(), &elasticity);
    world.removeSoftBody(body.get());
    std::fprintf(stderr, "%s, %d substeps a frame: sag %g m after %zu frames\n", implicit ? "implicit" : "explicit",
                 substeps, sunk, times.size());
    std::nth_element(times.begin(), times.begin() + std::ptrdiff_t(times.size() / 2), times.end());
    return std::isfinite(sunk) ? 1e3 * times[times.size() / 2] : 0;
}

/// Along the axes and the diagonals of faces, and from each node to the one after its neighbour: the springs that ours
/// have.
void add_links(btSoftBody& body) {
    constexpr int kSteps[12][3] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {2, 0, 0},  {0, 2, 0}, {0, 0, 2},
                                   {1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}};
    const auto inside = [](int at) { return at >= 0 && at < kSide; };
    for (const auto& step : kSteps)
        for (int k = 0; k < kSide; ++k)
            for (int j = 0; j < kSide; ++j)
                for (int i = 0; i < kSide; ++i)
                    if (inside(i + step[0]) && inside(j + step[1]) && inside(k + step[2]))
                        body.appendLink(node(i, j, k), node(i + step[0], j + step[1], k + step[2]));
}

double measure_springs(int frames) {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver constraints;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration);
    world.setGravity(kGravity);
    world.getWorldInfo().m_gravity = kGravity;
    const auto body = make_nodes(world.getWorldInfo());
    add_links(*body);
    body->setTotalMass(kDensity); // of 1 m^3
    hold_a_face(*body);
    body->m_cfg.piterations = 10;
    world.addSoftBody(body.get());
    std::fprintf(stderr, "%d links\n", body->m_links.size());
    std::vector<double> times;
    for (int frame = 0; frame < frames; ++frame)
        times.push_back(peer::seconds([&] { world.stepSimulation(kFrame, 1, kFrame); }));
    std::fprintf(stderr, "springs: sag %g m after %zu frames\n", sag(*body), times.size());
    world.removeSoftBody(body.get());
    std::nth_element(times.begin(), times.begin() + std::ptrdiff_t(times.size() / 2), times.end());
    return 1e3 * times[times.size() / 2];
}

/// 200 boxes in a tray, as in bench/heap.h, with Bullet's own defaults but for the margin, which would be half a box.
class Heap {
public:
    Heap() {
        world_.setGravity(kGravity);
        const btVector3 up(0, 1, 0), along_x(1, 0, 0), along_z(0, 0, 1);
        add_plane(up, 0);
        for (const btVector3& side : {along_x, -along_x, along_z, -along_z}) add_plane(side, btScalar(-0.5));
        for (int i = 0; i < 200; ++i) add_piece(i);
    }
    ~Heap() {
        for (const auto& body : bodies_) world_.removeRigidBody(body.get());
    }
    Heap(const Heap&) = delete;
    Heap& operator=(const Heap&) = delete;

    double milliseconds(int frames) {
        return 1e3 / frames * peer::seconds([&] {
                   for (int frame = 0; frame < frames; ++frame) world_.stepSimulation(kFrame, 1, kFrame);
               });
    }
    /// m, of all that touches now.
    double deepest() {
        double deepest = 0;
        for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
            const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
            for (int p = 0; p < manifold.getNumContacts(); ++p)
                deepest = std::max(deepest, -double(manifold.getContactPoint(p).getDistance()));
        }
        return deepest;
    }

private:
    void add(btScalar mass, const btTransform& at, std::unique_ptr<btCollisionShape> shape) {
        btVector3 inertia(0, 0, 0);
        if (mass > 0) shape->calculateLocalInertia(mass, inertia);
        btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape.get(), inertia);
        info.m_startWorldTransform = at;
        info.m_friction = btScalar(0.7071); // Bullet multiplies both bodies' : 0.5
        info.m_restitution = btScalar(0.5477);
        shapes_.push_back(std::move(shape));
        bodies_.push_back(std::make_unique<btRigidBody>(info));
        world_.addRigidBody(bodies_.back().get());
    }
    void add_plane(const btVector3& normal, btScalar offset) {
        add(0, btTransform::getIdentity(), std::make_unique<btStaticPlaneShape>(normal, offset));
    }
    void add_piece(int i) {
        constexpr int kCells[4][3] = {{3, 3, 3}, {4, 3, 2}, {5, 2, 3}, {3, 4, 3}};
        constexpr btScalar kCell = btScalar(0.025);
        const int* cells = kCells[i % 4];
        const btVector3 size = kCell * btVector3(btScalar(cells[0]), btScalar(cells[1]), btScalar(cells[2]));
        auto shape = std::make_unique<btBoxShape>(size / 2);
        shape->setMargin(btScalar(0.001));
        const int x = i % 5, z = i / 5 % 5, y = i / 25;
        const btQuaternion turn(btVector3(1, btScalar(i % 3), btScalar(i % 5)).normalized(),
                                btScalar(0.4) * btScalar(7 * i % 16));
        const btVector3 at(btScalar(0.16) * btScalar(x - 2) + btScalar(0.01) * btScalar(y % 3),
                           btScalar(0.1) + btScalar(0.15) * btScalar(y),
                           btScalar(0.14) * btScalar(z - 2) + btScalar(0.01) * btScalar(2 * y % 3));
        add(2600 * size.x() * size.y() * size.z(), btTransform(turn, at), std::move(shape));
    }

    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btSequentialImpulseConstraintSolver solver_;
    btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

void measure_heap() {
    constexpr int kFalls = 60, kRests = 300, kRuns = 5;
    double falling = INFINITY, resting = INFINITY, deep = 0;
    for (int run = 0; run < kRuns; ++run) {
        Heap heap;
        falling = std::min(falling, heap.milliseconds(kFalls));
        deep = heap.deepest();
        heap.milliseconds(kRests - kFalls);
        resting = std::min(resting, heap.milliseconds(60));
    }
    std::fprintf(stderr, "heap: %g m deep after %d frames\n", deep, kFalls);
    peer::report("bullet.heap_falling", falling, "ms");
    peer::report("bullet.heap_resting", resting, "ms");
}

} // namespace

int main() {
    measure_heap();
    peer::report("bullet.neo_hookean_implicit", measure_neo_hookean(true, 1, 60), "ms");
    // Its example steps explicitly, at 1/240 s; stiffer bodies need more.
    for (const int substeps : {4, 16, 32, 64})
        if (const double time = measure_neo_hookean(false, substeps, 30); time > 0) {
            peer::report("bullet.neo_hookean_explicit", time, "ms");
            peer::report("bullet.neo_hookean_explicit_substeps", substeps, "substeps");
            break;
        }
    peer::report("bullet.springs", measure_springs(60), "ms");
}
