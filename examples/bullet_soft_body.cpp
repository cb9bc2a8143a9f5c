// Bullet moves the driver, the runtime restores the detail: a soft ball falls onto the ground.
//   bullet_soft_body MODEL.fil
// The adapter is one loop: the nodes of a soft body made of the driver's triangles are the driver's vertices.
#include <filigree_rt.h>

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

namespace {

/// A soft body whose node i is driver vertex i, `height` above where the driver rests.
btSoftBody* make_soft_body(const flg_model* model, const flg_info& info, btSoftBodyWorldInfo& world, float height) {
    std::vector<btScalar> places(flg_driver_rest(model),
                                 flg_driver_rest(model) + 3 * std::size_t{info.driver_vertices});
    const std::vector<int> triangles(flg_driver_triangles(model),
                                     flg_driver_triangles(model) + 3 * std::size_t{info.driver_triangles});
    for (std::size_t i = 1; i < places.size(); i += 3) places[i] += height;
    btSoftBody* body =
        btSoftBodyHelpers::CreateFromTriMesh(world, places.data(), triangles.data(), int(info.driver_triangles), false);
    body->m_cfg.kPR = 5;     // pressure: it stays round
    body->m_cfg.kDP = 0.05f; // damping: it comes to rest
    body->m_cfg.piterations = 4;
    body->setTotalMass(1, true);
    body->getCollisionShape()->setMargin(0.02f);
    return body;
}

/// Your simulator's arrays in.
void copy_nodes(const btSoftBody& body, std::vector<float>& driver) {
    for (int i = 0; i < body.m_nodes.size(); ++i)
        for (int k = 0; k < 3; ++k) driver[std::size_t(3 * i + k)] = float(body.m_nodes[i].m_x[k]);
}

} // namespace

int main(int argc, char** argv) {
    std::ifstream file(argc > 1 ? argv[1] : "", std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    flg_model* model = nullptr;
    if (const flg_status status = flg_open(bytes.data(), bytes.size(), nullptr, &model); status != FLG_OK) {
        std::fprintf(stderr, "bullet_soft_body: %s\n", flg_status_text(status));
        return 1;
    }
    flg_info info;
    info.struct_size = sizeof info;
    flg_get_info(model, &info);
    std::vector<std::max_align_t> pose(flg_pose_bytes(model) / sizeof(std::max_align_t) + 1),
        scratch(flg_scratch_bytes(model) / sizeof(std::max_align_t) + 1);
    std::vector<float> driver(3 * std::size_t{info.driver_vertices}), positions(3 * std::size_t{info.vertices});

    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity({0, -10, 0});
    world.getWorldInfo().m_gravity = {0, -10, 0};
    world.getWorldInfo().m_sparsesdf.Initialize();
    btStaticPlaneShape plane({0, 1, 0}, 0);
    btRigidBody ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane));
    world.addRigidBody(&ground);
    btSoftBody* body = make_soft_body(model, info, world.getWorldInfo(), 2);
    world.addSoftBody(body);

    float lowest = 0;
    for (int frame = 0; frame < 180; ++frame) {
        world.stepSimulation(1.0f / 60, 4, 1.0f / 240);
        copy_nodes(*body, driver);
        if (flg_set_pose(model, driver.data(), nullptr, info.driver_vertices, pose.data()) != FLG_OK ||
            flg_restore(model, pose.data(), positions.data(), nullptr, scratch.data()) != FLG_OK) // vertices out
            return 1;
        lowest = positions[1];
        for (std::size_t v = 0; v < info.vertices; ++v) lowest = std::min(lowest, positions[3 * v + 1]);
    }
    std::printf("%u vertices followed %d nodes; the lowest is %.3f above the ground\n", unsigned(info.vertices),
                body->m_nodes.size(), double(lowest));
    world.removeSoftBody(body);
    world.removeRigidBody(&ground);
    delete body;
    flg_close(model);
    return lowest > -0.1f && lowest < 0.2f ? 0 : 1; // it lies on the ground
}
