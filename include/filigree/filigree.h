// All of Filigree's core: meshes, stripping, poses, restoring, packing, files, points inside, quads.
//
//     #include <filigree/filigree.h>
//
//     const Mesh mesh = read_mesh("scan.ply").value().mesh;
//     const Model model = strip(mesh, {.base = 1000}).value().model;
//     const Restorer restorer = Restorer::create(model).value();
//     const auto bend = make_bend(world_bounds(mesh), Axis::z, 90);
//     write_mesh(restorer.mesh(warp_pose(*bend, model)).value(), "bent.ply");
//
// Bodies that move, break and melt have headers of their own: physics/material.h, body.h, world.h and simulation.h;
// fracture.h; skin.h and flesh.h for characters; scene.h for scene files; render.h for pictures. reference.h has the
// method of the student's report.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/fit.h"
#include "filigree/mesh.h"
#include "filigree/pack.h"
#include "filigree/pose.h"
#include "filigree/remesh.h"
#include "filigree/restore.h"
#include "filigree/result.h"
#include "filigree/sample.h"
#include "filigree/strip.h"
#include "filigree/types.h"
