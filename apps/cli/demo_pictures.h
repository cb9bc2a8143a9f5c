// What the demo shows: one picture of the whole job, and a film of it.
#pragma once

#include "picture_files.h"

#include <string>

namespace filigree::cli {

/// Five panels: mesh, driver, moved driver, restored mesh, its error as colours with a legend.
void draw_demo_panels(const DemoScene& scene, HeadlessRenderer& renderer, const std::string& path, Session& session);

/// The mesh from rest to the pose and back; pose_at(t), t from 0 to 1, gives the driver on the way. Of large meshes a
/// lower level is shown, the finest with at most 150,000 triangles.
void film_demo(const DemoScene& scene, const std::function<Pose(double)>& pose_at, HeadlessRenderer& renderer,
               const std::string& path, Session& session);

} // namespace filigree::cli
