// What the window has around the picture, each made by a function: who looks for a part of it finds it by its name.
#pragma once

#include <QString>

#include <array>

class QDialog;
class QMenu;
class QStatusBar;
class QWidget;

namespace filigree::studio {

class Actions;
class MainWindow;
class Viewport;
class Workbench;

/// The panels' names, in the order of their tabs.
inline constexpr std::array kPanels = {"model",    "quads", "detail", "deform", "body",
                                       "fracture", "fit",   "flesh",  "view"};

/// The mesh: where it came from, what it is, what is wrong with it, where to save it.
QWidget* make_model_panel(Workbench& workbench, const Actions& actions, QMenu* recent_files);
/// Quads of any mesh: how many, in which patches, and how well they came out.
QWidget* make_quads_panel(Workbench& workbench, const Actions& actions);
/// Levels and the detail code: how coarse the driver is, how detail is stored, and by which law it returns.
QWidget* make_detail_panel(Workbench& workbench);
/// Deforming by numbers and by hand.
QWidget* make_deform_panel(Workbench& workbench, const Actions& actions);
/// The body: what it is made of, where it stands, how it moves.
QWidget* make_body_panel(Workbench& workbench, const Actions& actions);
/// Pieces: where the mesh would break, how they look apart, and how hard it is to break.
QWidget* make_fracture_panel(Workbench& workbench, const Actions& actions);
/// Animations of other programs: how closely a driver is to follow, and what that comes to.
QWidget* make_fit_panel(Workbench& workbench, const Actions& actions);
/// A character that joints move as soft matter.
QWidget* make_flesh_panel(Workbench& workbench, const Actions& actions);
/// How the mesh is shown.
QWidget* make_view_panel(Workbench& workbench, Viewport& viewport, MainWindow& window);

/// Above the tabs, as in the report's window: zoom, less and more detail, deform, animate.
QWidget* make_overview(Workbench& workbench, const Actions& actions, QWidget* parent);
/// Below the viewport: reset, play, step, the frame shown, and what to make of the recording.
QWidget* make_timeline(Workbench& workbench, const Actions& actions, QWidget* parent);
/// What is shown and what it costs; and the work that runs, with its cancel button.
QStatusBar* make_status_bar(Workbench& workbench, Viewport& viewport, const Actions& actions, QWidget* parent);
/// Every key and every gesture of the mouse on one sheet, from the actions themselves.
QDialog* make_help_sheet(const Actions& actions, QWidget* parent);

/// "rms 2.1e-05, max 1.3e-04 of the diagonal; normals 95 %: 0.42°"; "" when nothing was measured.
QString error_text(const Workbench& workbench, bool in_full);

} // namespace filigree::studio
