// What is asked before a recording leaves: the format, and what matters of an animated GLB.
#pragma once

#include <QString>

#include <functional>

class QDialog;
class QWidget;

namespace filigree::studio {

class Workbench;

/// The sheet, to be opened. go_on: called with the extension of the format that was chosen ("glb").
QDialog* make_export_sheet(Workbench& workbench, std::function<void(const QString& extension)> go_on, QWidget* parent);

} // namespace filigree::studio
