// What commands draw beside their work. A program that is built without the renderer (FILIGREE_RENDER=OFF) has
// drawing_left_out.cpp in place of drawing.cpp: it says so before any work.
#pragma once

#include "pictures.h"

#include "filigree/io/gltf/gltf.h"
#include "filigree/mesh.h"
#include "filigree/remesh.h"
#include "filigree/restore.h"
#include "filigree/scene/body_look.h"
#include "filigree/scene/recording.h"
#include "filigree/scene/world_setup.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace filigree::cli {

/// Refuses, before any work, a name that ends in none of .png, .svg and .pdf, or lies in no folder.
void check_picture_path(const std::string& path);
/// Refuses the same of a picture that can only be a PNG.
void check_png_path(const std::string& path);

/// `a` coloured by how far each of its vertices is from `b`, with a legend; the vertices' rms and maximum stand below.
/// names: of the files.
void draw_distances(const Mesh& a, const Mesh& b, const std::array<std::string, 2>& names, const MeshDistance& distance,
                    UpAxis up, const std::string& path, Session& session);

/// A restored mesh, coloured by where it is expected to be off. name: of its file.
void draw_expected_error(const Model& model, const PoseError::Estimate& estimate, const Mesh& mesh,
                         const std::string& name, UpAxis up, const std::string& path, Session& session);

/// A colour for each patch.
void draw_quads(const QuadRemeshed& result, View view, UpAxis up, const std::string& path, Session& session);

/// Points blue, surface red, the half of the surface towards the viewer cut away.
void draw_points_inside(const Mesh& mesh, const std::vector<Vec3f>& points, double spacing, UpAxis up,
                        const std::string& path, Session& session);

/// Refuses a PNG that cannot be decoded. A program without the renderer takes all.
void check_png(const std::string& bytes, const std::string& path);

/// What a page shows while it loads: a JPEG of 1200 by 630 pixels with the first moment, from where the page's camera
/// is, so that all moments fit. poses: empty where the model is at rest. materials_beside: the file that the model came
/// from. What keeps the picture from being drawn becomes a warning, and there is no file.
void draw_poster(const Model& model, const FrameSource<Pose>& poses, const std::string& materials_beside,
                 const std::string& path, Session& session);
/// The same of a GLB.
void draw_poster(const GltfScene& scene, const std::string& path, Session& session);

struct DemoScene {
    const Mesh& mesh;          ///< as it came
    const Model& model;        ///< stripped
    const Pose& pose;          ///< of the driver, deformed
    const Mesh& restored;      ///< for the camera and its size; what is drawn is restored by the vertex shader
    const MeshDistance& error; ///< of the restored mesh against the full deformation
    UpAxis up;
};
/// One picture of the whole job, and a film of it; pose_at(t), t from 0 to 1, gives the driver on the way. Where one
/// cannot be made (no OpenGL, no ffmpeg, no room) there is a warning: neither is what the demo is about. Returns the
/// files.
std::vector<std::string> draw_demo(const DemoScene& scene, const std::function<Pose(double)>& pose_at,
                                   const std::string& picture, const std::string& film, Session& session);

/// The looks of a scene's bodies by their materials and textures, as of looks_of.
std::vector<BodyLook> looks_of_bodies(const ReadyScene& ready, Session& session);

/// Whether a name is one of a film: .mp4, .gif, or numbered .png.
bool is_film(const std::string& path);

/// Films of a scene.
class SceneFilms {
public:
    /// Opens them; refuses before any work what cannot be made.
    SceneFilms(const std::vector<std::string>& paths, const SceneFile& scene);
    ~SceneFilms();
    SceneFilms(const SceneFilms&) = delete;
    SceneFilms& operator=(const SceneFilms&) = delete;

    /// Draws and puts them into their places.
    void write(const SceneFile& scene, const ReadyScene& ready, const Recording& recording, Session& session);

private:
    struct Films;
    std::unique_ptr<Films> films_;
};

} // namespace filigree::cli
