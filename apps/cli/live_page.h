// A folder with a page in which the bodies of a scene move, and can be pulled (docs/live.md).
#pragma once

#include "report.h"
#include "session.h"
#include "web_page.h"

#include "filigree/scene.h"

#include <string>

namespace filigree::cli {

/// Sets the scene up and writes the page; nothing is simulated. folder: where the page goes. input: the file that the
/// user named, which is not written over. look: the heading and the logo; no poster. Fails as set_up does; unsuitable:
/// a body that cannot move in a page.
void export_live_page(const SceneFile& scene, const std::string& folder, const std::string& input, const WebLook& look,
                      Session& session, Report& report);

} // namespace filigree::cli
