#include "actions.h"

#include "icons.h"
#include "panels/overview.h"
#include "window.h"

#include <QActionGroup>
#include <QApplication>
#include <QFileDialog>
#include <QFileInfo>
#include <QKeyEvent>
#include <QMessageBox>
#include <QPushButton>

namespace filigree::studio {
namespace {

const QString kMeshes = QStringLiteral("Meshes (*.obj *.ply *.stl *.off *.glb)");
const QString kModels = QStringLiteral("Filigree models (*.fil)");
const QString kOpenable = QStringLiteral("Meshes and models (*.fil *.obj *.ply *.stl *.off *.glb *.gltf)");
const QString kAll = QStringLiteral("All files (*)");

/// "bend.obj" becomes "bend_%04d.obj": a file a frame.
QString numbered(const QString& path) {
    const QFileInfo file(path);
    if (file.fileName().contains('%')) return path;
    const QString name =
        file.completeBaseName() + QStringLiteral("_%04d") + (file.suffix().isEmpty() ? QString() : '.' + file.suffix());
    return file.path() == QStringLiteral(".") && !path.startsWith('.') ? name : file.path() + '/' + name;
}

} // namespace

struct Actions::Content {
    struct Entry {
        QAction* action;
        std::function<bool()> can, is_on;
    };

    Content(Actions& owner, Workbench& workbench_of, Viewport& viewport_of, MainWindow& window_of)
        : actions(owner), workbench(workbench_of), viewport(viewport_of), window(window_of) {}

    Actions& actions;
    Workbench& workbench;
    Viewport& viewport;
    MainWindow& window;
    std::vector<Entry> entries;
    QString folder;

    bool has_model() const { return workbench.state().model != nullptr; }
    bool has_recording() const { return workbench.frame_count() > 1; }
    const ViewSettings& view() const { return workbench.view().settings(); }

    QAction* add(const char* name, const QString& text, const QString& tip, const QString& shortcut,
                 std::function<void()> run, std::function<bool()> can = {}) {
        auto* action = new QAction(text, &actions);
        action->setObjectName(QLatin1String(name));
        if (!shortcut.isEmpty()) action->setShortcut(QKeySequence(shortcut, QKeySequence::PortableText));
        describe(action, tip);
        QObject::connect(action, &QAction::triggered, &window, [this, run = std::move(run)] {
            run();
            refresh();
        });
        window.addAction(action);
        entries.push_back({action, std::move(can), {}});
        return action;
    }
    /// One that is on or off.
    QAction* add_switch(const char* name, const QString& text, const QString& tip, const QString& shortcut,
                        std::function<bool()> is_on, std::function<void()> run, std::function<bool()> can = {}) {
        QAction* action = add(name, text, tip, shortcut, std::move(run), std::move(can));
        action->setCheckable(true);
        entries.back().is_on = std::move(is_on);
        return action;
    }
    /// A field of the view settings that is on or off.
    void add_view_switch(const char* name, const QString& text, const QString& tip, const QString& shortcut,
                         bool ViewSettings::*field, std::function<bool()> can = {}) {
        add_switch(
            name, text, tip, shortcut, [this, field] { return view().*field; },
            [this, field] {
                ViewSettings settings = view();
                settings.*field = !(settings.*field);
                workbench.view().set(settings);
            },
            std::move(can));
    }
    /// One of several values of a field of the view settings.
    template <class T>
    QAction* add_view_choice(const char* name, const QString& text, const QString& tip, const QString& shortcut,
                             T ViewSettings::*field, T value) {
        return add_switch(
            name, text, tip, shortcut, [this, field, value] { return view().*field == value; },
            [this, field, value] {
                ViewSettings settings = view();
                settings.*field = value;
                workbench.view().set(settings);
            });
    }

    static void describe(QAction* action, const QString& tip) {
        const QString keys = action->shortcut().toString(QKeySequence::NativeText);
        action->setStatusTip(tip);
        action->setToolTip(keys.isEmpty() ? tip : tip + QStringLiteral(" (") + keys + ')');
    }

    void refresh() {
        for (const Entry& entry : entries) {
            if (entry.can) entry.action->setEnabled(entry.can());
            if (entry.is_on) entry.action->setChecked(entry.is_on());
        }
        QUndoStack& history = workbench.document().undo_stack();
        actions.find("file.save")
            ->setText(window.file_path().isEmpty() ? QStringLiteral("&Save…") : QStringLiteral("&Save"));
        name_step("edit.undo", QStringLiteral("&Undo"), history.undoText());
        name_step("edit.redo", QStringLiteral("&Redo"), history.redoText());
    }
    void name_step(const char* name, const QString& verb, const QString& step) {
        QAction* action = actions.find(QLatin1String(name));
        const QString text = step.isEmpty() ? verb : verb + ' ' + step;
        if (action->text() == text) return;
        action->setText(text);
        describe(action, QString(text).remove('&'));
    }

    /// Asks for a file without stopping the window. `suffix`: to save under, to open when empty.
    void ask_for_file(const QString& name, const QString& title, const QStringList& filters, const QString& suffix,
                      const QString& proposal, std::function<void(const QString&)> use) {
        auto* dialog = new QFileDialog(&window, title, folder);
        dialog->setObjectName(name + QStringLiteral(".dialog"));
        dialog->setAttribute(Qt::WA_DeleteOnClose);
        dialog->setNameFilters(filters);
        if (suffix.isEmpty()) {
            dialog->setFileMode(QFileDialog::ExistingFile);
        } else {
            dialog->setAcceptMode(QFileDialog::AcceptSave);
            dialog->setDefaultSuffix(suffix);
            dialog->selectFile(proposal);
        }
        QObject::connect(dialog, &QFileDialog::fileSelected, &window,
                         [this, use = std::move(use)](const QString& path) {
                             folder = QFileInfo(path).absolutePath();
                             use(path);
                         });
        dialog->open();
    }
    /// Writes files by number: the dialog could not see that there are some already.
    void write_numbered(const QString& path, std::function<void(const std::string&)> write) {
        const std::string pattern = numbered(path).toStdString();
        const auto start = [this, pattern, write = std::move(write)] { window.write([&] { write(pattern); }); };
        const std::vector<std::string> existing =
            existing_outputs(pattern, std::max<std::size_t>(1, workbench.frame_count()));
        if (existing.empty()) return start();
        const QString first = QFileInfo(QString::fromStdString(existing.front())).fileName();
        auto* box =
            new QMessageBox(QMessageBox::Question, "Files are there already",
                            first + " is there already. Replace it and those after it?", QMessageBox::Cancel, &window);
        box->setObjectName("file.replace");
        box->setAttribute(Qt::WA_DeleteOnClose);
        QPushButton* replace = box->addButton("Replace", QMessageBox::AcceptRole);
        replace->setObjectName("file.replace.yes");
        QObject::connect(replace, &QPushButton::clicked, &window, start);
        box->open();
    }
    /// The document's name with another ending, to begin with.
    QString proposal(const QString& ending) const {
        const auto& source = workbench.state().source;
        const QString name = source ? QFileInfo(QString::fromStdString(source->name)).completeBaseName() : QString();
        return (name.isEmpty() ? QStringLiteral("model") : name) + ending;
    }

    void add_file_actions();
    void add_edit_actions();
    void add_view_actions();
    void add_body_actions();
    void add_help_actions();
    void cancel();
};

void Actions::Content::add_file_actions() {
    const auto with_model = [this] { return has_model(); };
    const auto with_recording = [this] { return has_recording(); };
    add("file.open", "&Open…", "Opens a mesh (OBJ, PLY, STL, OFF) or a model (FIL)", "Ctrl+O", [this] {
        ask_for_file("file.open", "Open a mesh or a model", {kOpenable, kAll}, {}, {},
                     [this](const QString& path) { window.open_file(path); });
    })->setIcon(icon(Icon::open));
    const auto save_as = [this] {
        ask_for_file("file.save_as", "Save the model", {kModels, kAll}, "fil", proposal(".fil"),
                     [this](const QString& path) { window.save_file(path); });
    };
    add(
        "file.save", "&Save", "Saves the model with its deformation and recording", "Ctrl+S",
        [this, save_as] { window.file_path().isEmpty() ? save_as() : window.save_file(window.file_path()); },
        with_model)
        ->setIcon(icon(Icon::save));
    add("file.save_as", "Save &as…", "Saves the model under another name", "Ctrl+Shift+S", save_as, with_model);
    add(
        "file.save_mesh", "Save &mesh…", "Saves the mesh at the level shown, as it is deformed now", "Ctrl+E",
        [this] {
            ask_for_file(
                "file.save_mesh", "Save the mesh", {kMeshes, kAll}, "obj", proposal("_deformed.obj"),
                [this](const QString& path) { window.write([&] { workbench.save_mesh(path.toStdString()); }); });
        },
        with_model)
        ->setIcon(icon(Icon::meshes));
    add(
        "file.save_driver", "Save &driver…", "Saves the driver as it is posed now, for another program to move", "",
        [this] {
            ask_for_file(
                "file.save_driver", "Save the driver", {"Meshes (*.ply *.obj)", kAll}, "ply", proposal("_driver.ply"),
                [this](const QString& path) { window.write([&] { workbench.save_driver(path.toStdString()); }); });
        },
        with_model);
    add(
        "file.export_film", "Export &film…", "Writes the recording as a film, seen as now (MP4, GIF or numbered PNGs)",
        "Ctrl+Shift+E",
        [this] {
            ask_for_file("file.export_film", "Export a film",
                         {"Films (*.mp4 *.gif)", "Numbered pictures (*.png)", kAll}, "mp4", proposal(".mp4"),
                         [this](const QString& path) {
                             if (path.endsWith(QStringLiteral(".png"), Qt::CaseInsensitive))
                                 write_numbered(path, [this](const std::string& to) { workbench.export_film(to, {}); });
                             else
                                 window.write([&] { workbench.export_film(path.toStdString(), {}); });
                         });
        },
        with_recording)
        ->setIcon(icon(Icon::film));
    add(
        "file.export_meshes", "Export mes&hes…", "Writes a mesh for each frame of the recording", "",
        [this] {
            ask_for_file("file.export_meshes", "Export a mesh for each frame", {kMeshes, kAll}, "obj",
                         proposal("_%04d.obj"), [this](const QString& path) {
                             write_numbered(path, [this](const std::string& to) { workbench.export_meshes(to); });
                         });
        },
        with_recording)
        ->setIcon(icon(Icon::meshes));
    add("file.quit", "&Quit", "Leaves; asks about unsaved changes first", "Ctrl+Q", [this] { window.close(); });
}

void Actions::Content::cancel() {
    if (workbench.is_pulling()) {
        QKeyEvent escape(QEvent::KeyPress, Qt::Key_Escape, Qt::NoModifier);
        QCoreApplication::sendEvent(&viewport, &escape); // it holds what is dragged
        workbench.cancel_pull();
    } else {
        workbench.jobs().cancel();
    }
}

void Actions::Content::add_edit_actions() {
    const auto with_model = [this] { return has_model(); };
    QUndoStack& history = workbench.document().undo_stack();
    add(
        "edit.undo", "&Undo", "Undo", "Ctrl+Z", [&history] { history.undo(); },
        [&history] { return history.canUndo(); })
        ->setIcon(icon(Icon::undo));
    add(
        "edit.redo", "&Redo", "Redo", "Ctrl+Shift+Z", [&history] { history.redo(); },
        [&history] { return history.canRedo(); })
        ->setIcon(icon(Icon::redo));
    add(
        "edit.reset_deformation", "Reset &deformation", "Back to the shape at rest: no sliders, pulls or pins",
        "Ctrl+R", [this] { workbench.reset_deformation(); },
        [this] {
            return !workbench.state().warps.none() || !workbench.state().handles.empty() ||
                   workbench.state().handle_pose != nullptr;
        })
        ->setIcon(icon(Icon::reset));
    add(
        "edit.unpin_all", "Unp&in all", "Takes out all pins", "Ctrl+Shift+P", [this] { workbench.unpin_all(); },
        [this] {
            return std::any_of(workbench.state().handles.begin(), workbench.state().handles.end(),
                               [](const Handle& handle) { return handle.pinned; });
        });
    add(
        "edit.cancel", "&Cancel", "Stops the work that runs, or lets go of a pull as if it had not been", "Esc",
        [this] { cancel(); }, [this] { return workbench.jobs().is_busy() || workbench.is_pulling(); });
    add(
        "quads.make", "Make &quads", "Makes the mesh regular quads in patches, as the Quads panel says", "Q",
        [this] {
            window.show_panel("quads");
            workbench.make_quads();
        },
        [this] { return has_model() && workbench.state().source->topology.faces > 0; });
    add(
        "detail.remove", "&Remove detail", "One level coarser", "PgDown", [this] { workbench.remove_detail(); },
        [this] {
            const State& state = workbench.state();
            return has_model() && state.level() > 0 &&
                   level_vertices(*state.model, state.level() - 1) < level_vertices(*state.model, state.level());
        })
        ->setIcon(icon(Icon::minus));
    add(
        "detail.add", "&Add detail", "One level finer", "PgUp", [this] { workbench.add_detail(); },
        [this] { return has_model() && workbench.state().level() < workbench.state().model->finest_level(); })
        ->setIcon(icon(Icon::plus));
    add(
        "deform.open", "De&form", "The deformations: stretch, squeeze, bend, twist, taper, and pulling by hand", "F",
        [this] {
            workbench.set_mode(Mode::deform);
            window.show_panel("deform");
        },
        with_model)
        ->setIcon(icon(Icon::deform));
    auto* tools = new QActionGroup(&actions);
    const auto tool = [&](const char* name, const QString& text, const QString& tip, const QString& key, Tool value,
                          Icon picture) {
        QAction* action = add_view_choice(name, text, tip, key, &ViewSettings::tool, value);
        action->setIcon(icon(picture));
        tools->addAction(action);
    };
    tool("tool.pull", "&Pull", "Drag the surface to pull it", "P", Tool::pull, Icon::pull);
    tool("tool.pin", "Pi&n", "Click or paint the surface to pin it; with Ctrl to take pins out", "N", Tool::pin,
         Icon::pin);
    tool("tool.turn", "&Turn", "Drag anywhere to turn the view", "T", Tool::turn, Icon::turn);
}

void Actions::Content::add_view_actions() {
    const auto with_model = [this] { return has_model(); };
    const auto look = [&](const char* name, const QString& text, const QString& tip, const QString& key, View from) {
        add(
            name, text, tip, key, [this, from] { viewport.look_from(from); }, with_model);
    };
    look("view.front", "&Front", "Looks from the front", "1", View::front);
    look("view.side", "&Side", "Looks from the right", "2", View::side);
    look("view.top", "&Top", "Looks from above", "3", View::top);
    look("view.iso", "&Corner", "Looks from the front, the right and above", "4", View::iso);
    add(
        "view.show_all", "Show &all", "The whole object, as large as it fits", "0", [this] { viewport.show_all(); },
        with_model)
        ->setIcon(icon(Icon::show_all));

    auto* styles = new QActionGroup(&actions);
    styles->addAction(add_view_choice("view.shaded", "S&haded", "The surface alone", "S", &ViewSettings::style,
                                      SurfaceStyle::shaded));
    styles->addAction(add_view_choice("view.edges", "Shaded with &edges", "The surface and the edges of its faces", "E",
                                      &ViewSettings::style, SurfaceStyle::edges));
    styles->addAction(add_view_choice("view.wireframe", "&Wireframe", "The edges of the faces alone", "W",
                                      &ViewSettings::style, SurfaceStyle::wireframe));
    auto* colors = new QActionGroup(&actions);
    colors->addAction(add_view_choice("view.color_own", "&Own colours", "The mesh's own colours", "Shift+1",
                                      &ViewSettings::coloring, Coloring::own));
    colors->addAction(add_view_choice("view.color_error", "E&rror as colours",
                                      "How far each vertex is from the full deformation", "Shift+2",
                                      &ViewSettings::coloring, Coloring::error));
    colors->addAction(add_view_choice("view.color_levels", "&Levels as colours",
                                      "The level at which each vertex is added", "Shift+3", &ViewSettings::coloring,
                                      Coloring::levels));
    colors->addAction(add_view_choice("view.color_patches", "Patc&hes as colours",
                                      "The patches of regular quads, each in a colour unlike its neighbours'",
                                      "Shift+4", &ViewSettings::coloring, Coloring::patches));
    add_view_switch("view.split", "S&plit view", "Driver, restored mesh and full deformation side by side", "V",
                    &ViewSettings::split);
    add_view_switch("view.driver", "&Driver over the mesh", "The driver's edges over the mesh", "D",
                    &ViewSettings::driver);
    add_view_switch("view.defects", "Defec&ts", "Marks open and non-manifold edges", "Shift+D", &ViewSettings::defects);
    add_view_switch("view.particles", "&Particles", "The particles of the body instead of its surface", "B",
                    &ViewSettings::particles, [this] { return workbench.playback().has_body(); });
    add_view_switch("view.inside_points", "&Inside points", "Points inside the mesh at rest", "I",
                    &ViewSettings::inside_points);
    add_view_switch("view.clip", "Clip pla&ne", "Cuts the mesh open", "C", &ViewSettings::clip);
    add_view_switch("view.level_by_distance", "Level by &distance", "The level shown follows the size on the screen",
                    "L", &ViewSettings::level_by_distance);
    add_view_switch("view.keep_up", "Coarser while &moving", "A coarser level while things move, where drawing is slow",
                    "M", &ViewSettings::keep_up);
    add_view_switch("view.ground", "&Ground", "The ground with the object's shadow", "G", &ViewSettings::ground);
    add(
        "view.measure_error", "M&easure error", "Measures what is shown against the full deformation", "Ctrl+M",
        [this] { workbench.measure_error(); }, with_model);

    auto* themes = new QActionGroup(&actions);
    const auto theme = [&](const char* name, const QString& text, const QString& tip, Theme value) {
        themes->addAction(add_switch(
            name, text, tip, {}, [this, value] { return window.theme() == value; },
            [this, value] { window.set_theme(value); }));
    };
    theme("view.system_theme", "Theme of the s&ystem", "Light or dark, as the desktop is", Theme::system);
    theme("view.light_theme", "Light theme", "Dark text on light ground", Theme::light);
    theme("view.dark_theme", "Dark theme", "Light text on dark ground", Theme::dark);

    auto* panels = new QActionGroup(&actions);
    int number = 1;
    for (const char* name : {"model", "quads", "detail", "deform", "body", "view"}) {
        QString title = QLatin1String(name);
        title[0] = title[0].toUpper();
        panels->addAction(add_switch(("panel." + std::string(name)).c_str(), title + " panel",
                                     "Shows the panel " + title, QStringLiteral("Ctrl+%1").arg(number++),
                                     [this, name] { return window.panel() == QLatin1String(name); },
                                     [this, name] { window.show_panel(name); }));
    }
}

void Actions::Content::add_body_actions() {
    const auto with_model = [this] { return has_model(); };
    add(
        "body.make", "&Make body", "Fills the mesh with particles and drops it on the ground", "Ctrl+B",
        [this] { workbench.make_body(); }, with_model);
    add(
        "body.play", "&Play", "Moves the body; makes it where there is none", "Space", [this] { workbench.play(); },
        [this] { return has_model() && !workbench.is_playing(); })
        ->setIcon(icon(Icon::play));
    add(
        "body.pause", "P&ause", "Stops where it is", "Space", [this] { workbench.pause(); },
        [this] { return workbench.is_playing(); })
        ->setIcon(icon(Icon::pause));
    add(
        "body.step", "&Step", "One frame on", "Right", [this] { workbench.step(); },
        [this] { return has_model() && !workbench.is_playing(); })
        ->setIcon(icon(Icon::step));
    add(
        "body.back", "Step &back", "One frame back in the recording", "Left",
        [this] { workbench.go_to_frame(workbench.frame() - 1); },
        [this] { return workbench.frame_count() > 0 && workbench.frame() > 0 && !workbench.is_playing(); });
    add(
        "body.reset", "&Reset", "Back to the start; empties the recording", "Home", [this] { workbench.reset(); },
        [this] { return workbench.playback().has_body() || has_recording(); })
        ->setIcon(icon(Icon::reset));
    add(
        "body.animate", "A&nimate", "Drops the mesh on the ground as a soft body and plays", "A",
        [this] {
            workbench.animate();
            window.show_panel("body");
        },
        with_model)
        ->setIcon(icon(Icon::animate));
}

void Actions::Content::add_help_actions() {
    add("help.shortcuts", "&Shortcuts and mouse", "All keys and what the mouse does", "F1",
        [this] { window.show_help(); });
    add("help.about", "&About Filigree", "What this program is", "", [this] {
        auto* box = new QMessageBox(&window);
        box->setObjectName("help.about.dialog");
        box->setAttribute(Qt::WA_DeleteOnClose);
        box->setWindowTitle("About Filigree");
        box->setIconPixmap(icon(Icon::logo).pixmap(48));
        box->setText("<b>Filigree " + QApplication::applicationVersion() + "</b>");
        box->setInformativeText(
            "Takes detail off a mesh, lets anything move what is left, puts the detail back.\n\n"
            "Drawn by " +
            QString::fromStdString(viewport.timings().renderer.empty() ? "OpenGL" : viewport.timings().renderer) + ".");
        box->open();
    });
}

Actions::Actions(Workbench& workbench, Viewport& viewport, MainWindow& window)
    : content_(new Content(*this, workbench, viewport, window)) {
    Content& content = *content_;
    content.add_file_actions();
    content.add_edit_actions();
    content.add_view_actions();
    content.add_body_actions();
    content.add_help_actions();

    const auto refresh = [this] { content_->refresh(); };
    connect(&workbench.document(), &Document::changed, this, refresh);
    connect(&workbench.document().undo_stack(), &QUndoStack::indexChanged, this, refresh);
    connect(&workbench.document().undo_stack(), &QUndoStack::cleanChanged, this, refresh);
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
    for (const Content::Entry& entry : content_->entries)
        if (entry.action->objectName() == name) return entry.action;
    return nullptr;
}

std::vector<QAction*> Actions::all() const {
    std::vector<QAction*> result;
    for (const Content::Entry& entry : content_->entries) result.push_back(entry.action);
    return result;
}

} // namespace filigree::studio
