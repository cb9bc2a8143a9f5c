#include "actions.h"

#include "coloring.h"
#include "export_sheet.h"
#include "file_dialogs.h"
#include "icons.h"
#include "motion_file.h"
#include "panels/panels.h"
#include "pins.h"
#include "softness.h"
#include "tools/tool.h"
#include "window.h"
#include "words.h"

#include "filigree/file.h"
#include "filigree/physics/material.h"

#include <QActionGroup>
#include <QApplication>
#include <QFileInfo>
#include <QKeyEvent>
#include <QMessageBox>

#include <map>

namespace filigree::studio {
namespace {

const QString kModels = QStringLiteral("Filigree models (*.fil)");
const QString kAll = QStringLiteral("All files (*)");

/// " *.obj *.ply ...", for a file dialog.
QString mesh_patterns(bool for_reading) {
    QString patterns;
    for (const MeshFormatInfo& info : mesh_formats())
        for (const std::string_view extension : {info.extension, info.other_extension})
            if (!extension.empty() && (for_reading || extension == info.extension))
                patterns += " *" + QString::fromUtf8(extension.data(), qsizetype(extension.size()));
    return patterns;
}

const QString kMeshes = "Meshes (" + mesh_patterns(false).trimmed() + ')';
const QString kOpenable = "Meshes, models and animations (*.fil *.pc2 *.mdd" + mesh_patterns(true) + ')';
const QString kMoving = "Animations (*.pc2 *.mdd" + mesh_patterns(true) + ')';

/// A row of a menu.
struct Command {
    QString name = {}, text = {}, tip = {}; ///< no name: a separator
    QString keys = {};                      ///< "": no shortcut
    std::function<void()> run = {};
    std::function<bool()> can = {}; ///< unset: always
    QIcon icon = {};
    std::function<bool()> is_on = {}; ///< unset: it is no switch
    const char* group = "";           ///< of switches of which one is on
};

const Command kSeparator = {};

void describe(QAction* action, const QString& tip) {
    const QString keys = action->shortcut().toString(QKeySequence::NativeText);
    action->setStatusTip(tip);
    action->setToolTip(keys.isEmpty() ? tip : tip + QStringLiteral(" (") + keys + ')');
}

} // namespace

struct Actions::Impl {
    Impl(Actions& owner, Workbench& workbench_of, Viewport& viewport_of, MainWindow& window_of)
        : actions(owner), workbench(workbench_of), viewport(viewport_of), window(window_of), dialogs(window_of) {}

    Actions& actions;
    Workbench& workbench;
    Viewport& viewport;
    MainWindow& window;
    FileDialogs dialogs;
    struct Entry {
        QAction* action;
        std::function<bool()> can, is_on;
    };
    std::vector<Entry> entries;
    std::vector<ActionMenu> menus;
    std::map<std::string, QActionGroup*> groups;

    // Conditions of commands.
    std::function<bool()> has_model = [this] { return workbench.state().model != nullptr; };
    std::function<bool()> has_recording = [this] { return workbench.frame_count() > 1; };
    std::function<bool()> is_at_rest = [this] { return has_model() && !workbench.is_playing(); };
    bool can_remove_detail() const {
        const State& state = workbench.state();
        return state.model && state.level() > 0 &&
               level_counts(*state.model, state.level() - 1).vertices <
                   level_counts(*state.model, state.level()).vertices;
    }

    const ViewSettings& view() const { return workbench.view().settings(); }
    /// A field of the view settings that is on or off.
    Command view_switch(const char* name, const QString& text, const QString& tip, const char* keys,
                        bool ViewSettings::*field, std::function<bool()> can = {}) {
        return {name,
                text,
                tip,
                keys,
                [this, field] { workbench.view().edit([&](ViewSettings& s) { s.*field = !(s.*field); }); },
                std::move(can),
                {},
                [this, field] { return view().*field; }};
    }
    /// One of several values of a field of the view settings.
    template <class T>
    Command view_choice(const char* group, const QString& name, const QString& text, const QString& tip,
                        const char* keys, T ViewSettings::*field, T value, const QIcon& picture = {}) {
        return {name,
                text,
                tip,
                keys,
                [this, field, value] { workbench.view().edit([&](ViewSettings& s) { s.*field = value; }); },
                {},
                picture,
                [this, field, value] { return view().*field == value; },
                group};
    }
    Command look(const char* name, const QString& text, const QString& tip, const char* keys, View from) {
        return {name, text, tip, keys, [this, from] { viewport.look_from(from); }, has_model};
    }
    Command theme(const char* name, const QString& text, const QString& tip, Theme value) {
        Command command{name, text, tip, "", [this, value] { window.set_theme(value); }};
        command.is_on = [this, value] { return window.theme() == value; };
        command.group = "themes";
        return command;
    }
    Command panel(std::size_t number) {
        const QString name = kPanels[number], title = title_of(kPanels[number]);
        Command command{"panel." + name, title + " panel", "Shows the panel " + title,
                        QString("Ctrl+%1").arg(number + 1), [this, name] { window.show_panel(name); }};
        command.is_on = [this, name] { return window.panel() == name; };
        command.group = "panels";
        return command;
    }

    std::vector<Command> file_menu() {
        return {
            {"file.open",
             "&Open…",
             "Opens a mesh or a model (.fil)",
             "Ctrl+O",
             [this] { open(); },
             {},
             icon(Icon::open)},
            kSeparator,
            {"file.save", "&Save", "Saves the model with its deformation and recording", "Ctrl+S", [this] { save(); },
             has_model, icon(Icon::save)},
            {"file.save_as", "Save &as…", "Saves the model under another name", "Ctrl+Shift+S", [this] { save_as(); },
             has_model},
            kSeparator,
            {"file.save_mesh", "Save &mesh…", "Saves the mesh at the level shown, as it is deformed now", "Ctrl+E",
             [this] {
                 save_to({"file.save_mesh", "Save the mesh", {kMeshes, kAll}, "obj", proposal("_deformed.obj")},
                         &Workbench::save_mesh);
             },
             has_model, icon(Icon::meshes)},
            {"file.save_driver", "Save &driver…", "Saves the driver as it is posed now, for another program to move",
             "",
             [this] {
                 save_to({"file.save_driver",
                          "Save the driver",
                          {"Meshes (*.ply *.obj)", kAll},
                          "ply",
                          proposal("_driver.ply")},
                         &Workbench::save_driver);
             },
             has_model},
            kSeparator,
            {"file.export_film", "Export &film…",
             "Writes the recording as a film, seen as now (MP4, GIF or numbered PNGs)", "Ctrl+Shift+E",
             [this] { export_film(); }, has_recording, icon(Icon::film)},
            {"file.export_animation", "Export a&nimation…",
             "Writes the recording as GLB, PC2 or MDD, for other programs", "Ctrl+Shift+G",
             [this] { export_animation(); }, has_recording, icon(Icon::animate)},
            {"file.export_meshes", "Export mes&hes…", "Writes a mesh for each frame of the recording", "",
             [this] { export_meshes(); }, has_recording, icon(Icon::meshes)},
            kSeparator,
            {"fit.open",
             "Open ani&mation…",
             "Opens an animated glTF, one of numbered meshes, or a point cache (.pc2, .mdd) of the mesh that is open",
             "Ctrl+Shift+O",
             [this] { open_motion(); },
             {},
             icon(Icon::open)},
            {"fit.make", "Fi&t", "Finds the smallest driver that follows the animation, in the background", "Ctrl+F",
             [this] {
                 window.show_panel("fit");
                 workbench.fit();
             },
             [this] { return workbench.can_fit(); }},
            {"flesh.make", "Make f&lesh", "Makes soft matter of the character, in the background", "Ctrl+Shift+B",
             [this] {
                 window.show_panel("flesh");
                 workbench.make_flesh();
             },
             [this] { return workbench.can_make_flesh(); }},
            {"fit.save_packed", "Save pac&ked…", "Saves the fitted model in few bytes", "",
             [this] {
                 save_to({"fit.save_packed", "Save the fitted model", {kModels, kAll}, "fil", proposal("_fitted.fil")},
                         &Workbench::save_packed);
             },
             [this] { return has_model() && workbench.state().recording && workbench.state().recording->fitted; },
             icon(Icon::save)},
            kSeparator,
            {"file.quit", "&Quit", "Leaves; asks about unsaved changes first", "Ctrl+Q", [this] { window.close(); }},
        };
    }

    std::vector<Command> edit_menu() {
        QUndoStack& history = workbench.document().undo_stack();
        return {
            {"edit.undo", "&Undo", "Undo", "Ctrl+Z", [&history] { history.undo(); },
             [&history] { return history.canUndo(); }, icon(Icon::undo)},
            {"edit.redo", "&Redo", "Redo", "Ctrl+Shift+Z", [&history] { history.redo(); },
             [&history] { return history.canRedo(); }, icon(Icon::redo)},
            kSeparator,
            {"quads.make", "Make &quads", "Makes the mesh regular quads in patches, as the Quads panel says", "Q",
             [this] {
                 window.show_panel("quads");
                 workbench.make_quads();
             },
             [this] { return has_model() && workbench.state().source->topology.faces > 0; }},
            {"fracture.cut", "Cut p&ieces", "Cuts the mesh where it would break, as the Fracture panel says", "X",
             [this] {
                 window.show_panel("fracture");
                 workbench.cut_pieces();
             },
             [this] { return has_model() && workbench.state().source->topology.faces > 0; }},
            {"fracture.whole", "Make &whole", "The mesh as it was before it was cut", "Shift+X",
             [this] { workbench.make_whole(); }, [this] { return has_model() && workbench.state().source->pieces; }},
            {"detail.remove", "&Remove detail", "One level coarser", "PgDown", [this] { workbench.remove_detail(); },
             [this] { return can_remove_detail(); }, icon(Icon::minus)},
            {"detail.add", "&Add detail", "One level finer", "PgUp", [this] { workbench.add_detail(); },
             [this] { return has_model() && workbench.state().level() < workbench.state().model->finest_level(); },
             icon(Icon::plus)},
            kSeparator,
            {"deform.open", "De&form", "The deformations: stretch, squeeze, bend, twist, taper, and pulling by hand",
             "F",
             [this] {
                 workbench.set_mode(Mode::deform);
                 window.show_panel("deform");
             },
             has_model, icon(Icon::deform)},
            {"edit.reset_deformation", "Reset &deformation", "Back to the shape at rest: no sliders, pulls or pins",
             "Ctrl+R", [this] { workbench.reset_deformation(); },
             [this] {
                 const State& state = workbench.state();
                 return !state.warps.none() || !state.handles.empty() || state.handle_pose;
             },
             icon(Icon::reset)},
            {"edit.unpin_all", "Unp&in all", "Takes out all pins", "Ctrl+Shift+P", [this] { workbench.unpin_all(); },
             [this] { return has_pins(workbench.state().handles); }},
            kSeparator,
        };
    }

    /// The lower part of the menu Edit.
    std::vector<Command> tool_menu() {
        std::vector<Command> menu;
        for (const ToolEntry* const tool : kTools)
            menu.push_back(view_choice("tools", QStringLiteral("tool.") + tool->name, tool->text, tool->tip, tool->keys,
                                       &ViewSettings::tool, tool, icon(tool->icon)));
        menu.push_back(kSeparator);
        menu.push_back({"edit.cancel", "&Cancel",
                        "Stops the work that runs, or lets go of a pull as if it had not been", "Esc",
                        [this] { cancel(); }, [this] { return workbench.jobs().is_busy() || workbench.is_pulling(); }});
        return menu;
    }

    /// The upper part of the view's menu.
    std::vector<Command> look_menu() {
        using V = ViewSettings;
        return {
            look("view.front", "&Front", "Looks from the front", "1", View::front),
            look("view.side", "&Side", "Looks from the right", "2", View::side),
            look("view.top", "&Top", "Looks from above", "3", View::top),
            look("view.iso", "&Corner", "Looks from the front, the right and above", "4", View::iso),
            {"view.show_all", "Show &all", "The whole object, as large as it fits", "0",
             [this] { viewport.show_all(); }, has_model, icon(Icon::show_all)},
            kSeparator,
            view_choice("styles", "view.shaded", "S&haded", "The surface alone", "S", &V::style, SurfaceStyle::shaded),
            view_choice("styles", "view.edges", "Shaded with &edges", "The surface and the edges of its faces", "E",
                        &V::style, SurfaceStyle::edges),
            view_choice("styles", "view.wireframe", "&Wireframe", "The edges of the faces alone", "W", &V::style,
                        SurfaceStyle::wireframe),
            kSeparator,
        };
    }

    std::vector<Command> color_menu() {
        std::vector<Command> menu;
        for (const Coloring* const coloring : colorings())
            menu.push_back(view_choice("colors", QStringLiteral("view.color_") + coloring->name, coloring->text,
                                       coloring->tip, coloring->keys, &ViewSettings::coloring, coloring));
        menu.push_back({"view.measure_error", "M&easure error", "Measures what is shown against the full deformation",
                        "Ctrl+M", [this] { workbench.measure_error(); }, has_model});
        menu.push_back(kSeparator);
        return menu;
    }

    std::vector<Command> view_menu() {
        using V = ViewSettings;
        std::vector<Command> menu = {
            view_switch("view.split", "S&plit view", "Driver, restored mesh and full deformation side by side", "V",
                        &V::split),
            view_switch("view.driver", "&Driver over the mesh", "The driver's edges over the mesh", "D", &V::driver),
            view_switch("view.defects", "Defec&ts", "Marks open and non-manifold edges", "Shift+D", &V::defects),
            view_switch("view.inside_points", "&Inside points", "Points inside the mesh at rest", "I",
                        &V::inside_points),
            view_switch("view.clip", "Clip pla&ne", "Cuts the mesh open", "C", &V::clip),
            view_switch("view.follow", "Follow the m&otion", "The camera goes along with what moves, as in films", "O",
                        &V::follow),
            view_switch("view.blender_mouse", "Blender's mo&use",
                        "The middle button turns the view, with Shift it moves it, with Ctrl it zooms", "",
                        &V::blender_mouse),
            view_switch("view.ground", "&Ground", "The ground with the object's shadow", "G", &V::ground),
            kSeparator,
            view_switch("view.level_by_distance", "Level by &distance",
                        "The level shown follows the size on the screen", "L", &V::level_by_distance),
            view_switch("view.keep_up", "Coarser while &moving",
                        "A coarser level while things move, where drawing is slow", "M", &V::keep_up),
            kSeparator,
        };
        for (std::size_t k = 0; k < kPanels.size(); ++k) menu.push_back(panel(k));
        menu.push_back(kSeparator);
        menu.push_back(
            theme("view.system_theme", "Theme of the s&ystem", "Light or dark, as the desktop is", Theme::system));
        menu.push_back(theme("view.light_theme", "Light theme", "Dark text on light ground", Theme::light));
        menu.push_back(theme("view.dark_theme", "Dark theme", "Light text on dark ground", Theme::dark));
        return menu;
    }

    std::vector<Command> body_menu() {
        return {
            {"body.make", "&Make body", "Fills the mesh with particles and drops it on the ground", "Ctrl+B",
             [this] { workbench.make_body(); }, has_model},
            {"body.fit_driver", "&Fit driver",
             "Takes a driver as fine as the body's particles, and makes the body again", "",
             [this] { workbench.fit_driver(); }, [this] { return workbench.playback().has_body(); }},
            {"body.animate", "A&nimate", "Drops the mesh on the ground as a soft body and plays", "A",
             [this] {
                 workbench.animate();
                 window.show_panel("body");
             },
             has_model, icon(Icon::animate)},
            {"body.clear_softness", "C&lear softness", "Takes away the painted softness", "",
             [this] {
                 workbench.set_softness(nullptr);
                 workbench.end_painting();
             },
             [this] { return has_model() && softness_of(workbench.state()) != nullptr; }},
            {"body.wax", "Make it &wax", "Makes the body of wax, which melts, and drops it", "", [this] { make_wax(); },
             has_model},
            kSeparator,
            {"body.play", "&Play", "Moves the body; makes it where there is none", "Space",
             [this] { workbench.play(); }, is_at_rest, icon(Icon::play)},
            {"body.pause", "P&ause", "Stops where it is", "Space", [this] { workbench.pause(); },
             [this] { return workbench.is_playing(); }, icon(Icon::pause)},
            {"body.step", "&Step", "One frame on", "Right", [this] { workbench.step(); }, is_at_rest, icon(Icon::step)},
            {"body.back", "Step &back", "One frame back in the recording", "Left",
             [this] { workbench.go_to_frame(workbench.frame() - 1); },
             [this] { return workbench.frame_count() > 0 && workbench.frame() > 0 && !workbench.is_playing(); }},
            {"body.reset", "&Reset", "Back to the start; empties the recording", "Home", [this] { workbench.reset(); },
             [this] { return workbench.playback().has_body() || has_recording(); }, icon(Icon::reset)},
            kSeparator,
            {"body.melt", "&Melt", "Puts a body that melts into warm air, and plays", "Ctrl+Shift+M",
             [this] { workbench.melt(); }, [this] { return has_model() && workbench.can_melt(); }},
            {"body.freeze", "Free&ze", "Puts a body that melts into cold air, and plays", "Ctrl+Shift+F",
             [this] { workbench.freeze(); }, [this] { return has_model() && workbench.can_melt(); }},
            kSeparator,
            view_switch("view.particles", "&Particles", "The particles of the body instead of its surface", "B",
                        &ViewSettings::particles, [this] { return workbench.playback().has_body(); }),
        };
    }

    std::vector<Command> help_menu() {
        return {
            {"help.shortcuts", "&Shortcuts and mouse", "All keys and what the mouse does", "F1",
             [this] { window.show_help(); }},
            {"help.about", "&About Filigree", "What this program is", "", [this] { show_about(); }},
        };
    }

    void add_menu(const char* name, const QString& title, const std::vector<Command>& commands) {
        ActionMenu menu{name, title, {}};
        for (const Command& command : commands) menu.actions.push_back(command.name.isEmpty() ? nullptr : add(command));
        menus.push_back(std::move(menu));
    }

    QAction* add(const Command& command) {
        auto* action = new QAction(command.text, &actions);
        action->setObjectName(command.name);
        if (!command.keys.isEmpty()) action->setShortcut(QKeySequence(command.keys, QKeySequence::PortableText));
        describe(action, command.tip);
        if (!command.icon.isNull()) action->setIcon(command.icon);
        action->setCheckable(bool(command.is_on));
        if (*command.group) {
            QActionGroup*& group = groups[command.group];
            if (!group) group = new QActionGroup(&actions);
            group->addAction(action);
        }
        QObject::connect(action, &QAction::triggered, &window, [this, run = command.run] {
            run();
            refresh();
        });
        window.addAction(action);
        entries.push_back({action, command.can, command.is_on});
        return action;
    }

    void refresh() {
        for (const Entry& entry : entries) {
            if (entry.can) entry.action->setEnabled(entry.can());
            if (entry.is_on) entry.action->setChecked(entry.is_on());
        }
        QUndoStack& history = workbench.document().undo_stack();
        actions.find("file.save")->setText(window.file_path().isEmpty() ? "&Save…" : "&Save");
        name_step("edit.undo", "&Undo", history.undoText());
        name_step("edit.redo", "&Redo", history.redoText());
    }

    void name_step(const char* name, const QString& verb, const QString& step) {
        QAction* action = actions.find(QLatin1String(name));
        const QString text = step.isEmpty() ? verb : verb + ' ' + step;
        if (action->text() == text) return;
        action->setText(text);
        describe(action, QString(text).remove('&'));
    }

    /// The document's name with another ending, to begin with.
    QString proposal(const QString& ending) const {
        const auto& source = workbench.state().source;
        const QString name = source ? QFileInfo(QString::fromStdString(source->name)).completeBaseName() : QString();
        return (name.isEmpty() ? QStringLiteral("model") : name) + ending;
    }

    void open() {
        dialogs.ask({"file.open", "Open a mesh or a model", {kOpenable, kAll}},
                    [this](const QString& path) { window.open_file(path); });
    }

    void open_motion() {
        dialogs.ask({"fit.open", "Open an animation", {kMoving, kAll}}, [this](const QString& path) {
            const bool replaces = !is_point_cache(path.toStdString()); // a cache moves the mesh there is
            if (replaces && !window.may_discard()) return;
            if (window.panel() != "flesh") window.show_panel("fit");
            workbench.open_motion(path.toStdString());
        });
    }

    void save_as() {
        dialogs.ask({"file.save_as", "Save the model", {kModels, kAll}, "fil", proposal(".fil")},
                    [this](const QString& path) { window.save_file(path); });
    }

    void save() { window.file_path().isEmpty() ? save_as() : window.save_file(window.file_path()); }

    void save_to(const FileQuestion& question, void (Workbench::*write)(const std::string&)) {
        dialogs.ask(question, [this, write](const QString& path) {
            window.write([&] { (workbench.*write)(path.toStdString()); });
        });
    }

    void export_film() {
        dialogs.ask({"file.export_film",
                     "Export a film",
                     {"Films (*.mp4 *.gif)", "Numbered pictures (*.png)", kAll},
                     "mp4",
                     proposal(".mp4")},
                    [this](const QString& path) {
                        const auto write = [this](const std::string& to) {
                            window.write([&] { workbench.export_film(to, {}); });
                        };
                        if (path.endsWith(QStringLiteral(".png"), Qt::CaseInsensitive))
                            dialogs.ask_to_replace(path, workbench.frame_count(), write);
                        else
                            write(path.toStdString());
                    });
    }

    void export_animation() {
        const auto ask = [this](const QString& extension) {
            dialogs.ask(
                {"file.export_animation",
                 "Export the animation",
                 {"Animations (*.glb *.pc2 *.mdd *.usda)", kAll},
                 extension,
                 proposal('.' + extension)},
                [this](const QString& path) { window.write([&] { workbench.export_animation(path.toStdString()); }); });
        };
        make_export_sheet(workbench, ask, &window)->open();
    }

    void export_meshes() {
        dialogs.ask(
            {"file.export_meshes", "Export a mesh for each frame", {kMeshes, kAll}, "obj", proposal("_%04d.obj")},
            [this](const QString& path) {
                dialogs.ask_to_replace(path, workbench.frame_count(), [this](const std::string& to) {
                    window.write([&] { workbench.export_meshes(to); });
                });
            });
    }

    void make_wax() {
        const auto materials = named_materials();
        const auto wax = std::ranges::find(materials, std::string_view("wax"), &NamedMaterial::name);
        BodySettings body = workbench.state().body;
        body.preset = "wax";
        body.material = wax->material;
        workbench.set_body(body);
        workbench.animate();
        window.show_panel("body");
    }

    void cancel() {
        if (!workbench.is_pulling()) return workbench.jobs().cancel();
        QKeyEvent escape(QEvent::KeyPress, Qt::Key_Escape, Qt::NoModifier);
        QCoreApplication::sendEvent(&viewport, &escape); // it holds what is dragged
        workbench.cancel_pull();
    }

    void show_about() {
        const std::string& renderer = viewport.timings().renderer;
        auto* box = new QMessageBox(&window);
        box->setObjectName("help.about.dialog");
        box->setAttribute(Qt::WA_DeleteOnClose);
        box->setWindowTitle("About Filigree");
        box->setIconPixmap(icon(Icon::logo).pixmap(48));
        box->setText("<b>Filigree " + QApplication::applicationVersion() + "</b>");
        box->setInformativeText("Takes detail off a mesh, lets anything move what is left, puts the detail back.\n\n"
                                "Drawn by " +
                                QString::fromStdString(renderer.empty() ? "OpenGL" : renderer) + ".");
        box->open();
    }
};

Actions::Actions(Workbench& workbench, Viewport& viewport, MainWindow& window)
    : impl_(new Impl(*this, workbench, viewport, window)) {
    std::vector<Command> edit = impl_->edit_menu(), view = impl_->look_menu();
    std::ranges::copy(impl_->tool_menu(), std::back_inserter(edit));
    std::ranges::copy(impl_->color_menu(), std::back_inserter(view));
    std::ranges::copy(impl_->view_menu(), std::back_inserter(view));
    impl_->add_menu("menu.file", "&File", impl_->file_menu());
    impl_->add_menu("menu.edit", "&Edit", edit);
    impl_->add_menu("menu.view", "&View", view);
    impl_->add_menu("menu.body", "&Body", impl_->body_menu());
    impl_->add_menu("menu.help", "&Help", impl_->help_menu());

    const auto refresh = [this] { impl_->refresh(); };
    QUndoStack& history = workbench.document().undo_stack();
    connect(&workbench.document(), &Document::changed, this, refresh);
    connect(&history, &QUndoStack::indexChanged, this, refresh);
    connect(&history, &QUndoStack::cleanChanged, this, refresh);
    connect(&workbench.jobs(), &Jobs::started, this, refresh);
    connect(&workbench.jobs(), &Jobs::finished, this, refresh);
    connect(&workbench.playback(), &Playback::state_changed, this, refresh);
    connect(&workbench.view(), &ViewState::changed, this, refresh);
    connect(&workbench, &Workbench::timeline_changed, this, refresh);
    connect(&workbench, &Workbench::mode_changed, this, refresh);
    connect(&workbench, &Workbench::opened, this, refresh);
    connect(&workbench, &Workbench::pose_changed, this, [this, &workbench] {
        find(QStringLiteral("edit.cancel"))->setEnabled(workbench.jobs().is_busy() || workbench.is_pulling());
    });
    connect(&window, &MainWindow::files_changed, this, refresh);
    connect(&window, &MainWindow::theme_changed, this, refresh);
    connect(&window, &MainWindow::panel_changed, this, refresh);
}

Actions::~Actions() = default;

QAction* Actions::find(const QString& name) const {
    for (const Impl::Entry& entry : impl_->entries)
        if (entry.action->objectName() == name) return entry.action;
    return nullptr;
}

const std::vector<ActionMenu>& Actions::menus() const { return impl_->menus; }

std::vector<QAction*> Actions::all() const {
    std::vector<QAction*> result;
    for (const Impl::Entry& entry : impl_->entries) result.push_back(entry.action);
    return result;
}

} // namespace filigree::studio
