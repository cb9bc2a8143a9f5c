// Coded files that people keep: those of tests/pack/kept_files, written by version 0.1 on 2026-11-27, are read as
// they were then. A ring of triangles and quads with a hole and loose vertices, in a random order; `crumpled` is a
// small ball.
#include "filigree/io/model/model_file.h"
#include "threads.h"

#include <gtest/gtest.h>

using namespace filigree;

namespace {

constexpr std::uint64_t kNothing = 14695981039346656037u;

/// FNV-1a of 64 bits.
class Digest {
public:
    template <class T>
    void add(const std::vector<T>& values) {
        for (const std::byte b : std::as_bytes(std::span(values)))
            value_ = (value_ ^ std::uint64_t(b)) * 1099511628211u;
    }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = kNothing;
};

struct KeptFile {
    const char* name;
    std::size_t frames;
    std::uint64_t mesh, poses;
};

TEST(KeptFiles, AreReadAsTheyWere) {
    const KeptFile files[] = {
        {"compact", 0, 0x041fd23fa0811287, kNothing},           // normals, colours and texture coordinates of vertices
        {"ordered", 0, 0x780465f431f60d5e, kNothing},           // the same, 12 bits, in its order
        {"surface", 0, 0xd756d49c0d852227, kNothing},           // vertices may slide
        {"corners", 0, 0x7fbbe9fded053134, kNothing},           // attributes of corners and labels, in its order
        {"stream", 0, 0x41b073d316f2ee2d, kNothing},            // the same, coarse to fine
        {"moving", 40, 0x041fd23fa0811287, 0xd12fa3891d7a0b67}, // compact, with poses
        {"crumpled", 64, 0x77e374e3b1ce34e7, 0x5f353c5a6390bdc5}, // poses without any order
        {"lossless", 6, 0xe810088715ebb798, 0x47e2bfd44f5da11d},  // plain model and poses
        {"lossless_corners", 0, 0x789c825a5a32bf74, kNothing},
    };
    for (const KeptFile& file : files) {
        SCOPED_TRACE(file.name);
        const std::string path = std::string(FILIGREE_ROOT "/tests/pack/kept_files/") + file.name + ".fil";
        const Result<Model> model = read_model(path, kTwoThreads);
        ASSERT_TRUE(model.ok()) << model.error().message;
        const Mesh& mesh = model->mesh;
        Digest of_mesh;
        of_mesh.add(mesh.positions);
        of_mesh.add(mesh.face_offsets);
        of_mesh.add(mesh.corners);
        of_mesh.add(mesh.uvs.values);
        of_mesh.add(mesh.uvs.corners);
        of_mesh.add(mesh.normals.values);
        of_mesh.add(mesh.normals.corners);
        of_mesh.add(mesh.colors);
        for (const auto* labels : {&mesh.objects, &mesh.groups, &mesh.materials}) of_mesh.add(labels->of_face);
        of_mesh.add(mesh.smoothing);
        of_mesh.add(driver_positions(*model));
        EXPECT_EQ(of_mesh.value(), file.mesh);
        const Result<PoseSequence> poses = read_poses(path, kTwoThreads);
        ASSERT_TRUE(poses.ok()) << poses.error().message;
        EXPECT_EQ(poses->frames.size(), file.frames);
        Digest of_poses;
        for (const Pose& pose : poses->frames) {
            of_poses.add(pose.positions);
            of_poses.add(pose.gradients);
        }
        EXPECT_EQ(of_poses.value(), file.poses);
    }
}

} // namespace
