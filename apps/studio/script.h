// Scripts drive the window as a user does: actions, controls and the mouse, a line each (docs/studio.md).
#pragma once

#include "window.h"

#include <filesystem>

namespace filigree::studio {

/// Keeps the last error of work in the background, with its code, for whoever has no eyes for the message bar.
class ErrorWatch {
public:
    explicit ErrorWatch(Workbench& workbench);
    /// Success, or the error since the last call.
    Status take();

private:
    QObject receiver_;
    std::optional<Error> last_;
};

/// What has to be set before the QApplication is made: its name, and the kind of OpenGL.
void prepare_application();

/// What a script can name, a line each: actions with their texts, controls with their tooltips.
std::string script_names(MainWindow& window);

/// Runs a script line by line; paths in it are relative to its folder. Errors: not_found, bad_file ("tour.txt:7: ..."),
/// and whatever a command of it ends with.
Status run_script(const std::filesystem::path& path, MainWindow& window);

/// The window as a picture, at its own scale, when all passes are drawn. Errors: unwritable.
Status save_screenshot(const std::filesystem::path& path, MainWindow& window);

/// Makes the body and simulates so many frames. Errors: whatever the body ends with.
Status simulate_frames(unsigned frames, MainWindow& window);

/// Waits until no job runs and the picture is whole, handling events. False after `seconds`.
bool wait_until_still(MainWindow& window, double seconds);

} // namespace filigree::studio
