#include "script.h"

#include "filigree/io/system/file.h"

#include <QAbstractButton>
#include <QAbstractSlider>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QBuffer>
#include <QComboBox>
#include <QDialog>
#include <QDoubleSpinBox>
#include <QElapsedTimer>
#include <QKeySequence>
#include <QMenu>
#include <QMouseEvent>
#include <QPainter>
#include <QPixmap>
#include <QStringList>
#include <QSurfaceFormat>
#include <QWheelEvent>

#include <cmath>
#include <csignal>
#include <functional>
#include <map>

namespace filigree::studio {

namespace {

Error usage(const QString& sentence) { return {ErrorCode::usage, sentence.toStdString()}; }

/// Handles what waits, for as long as nothing else would wake us.
void handle_events(int milliseconds = 5) { QCoreApplication::processEvents(QEventLoop::AllEvents, milliseconds); }

constexpr double kPatience = 600; // seconds that a command may take

/// The window as it is at this moment.
Status grab_window(const std::filesystem::path& path, MainWindow& window) {
    for (int k = 0; k < 3; ++k) QCoreApplication::sendPostedEvents(); // a text that grew, its layout, what that moves
    QPixmap picture = window.grab();
    for (QDialog* const dialog : window.findChildren<QDialog*>()) // what stands over the window belongs to it
        if (dialog->isVisible()) {
            const QPoint middle((window.width() - dialog->width()) / 2, (window.height() - dialog->height()) / 2);
            QPainter painter(&picture);
            painter.drawPixmap(middle, dialog->grab());
            painter.setPen(dialog->palette().color(QPalette::Mid)); // the frame that a window manager would give it
            painter.drawRect(QRect(middle, dialog->size()).adjusted(-1, -1, 0, 0));
        }
    QByteArray bytes;
    QBuffer buffer(&bytes);
    if (!buffer.open(QIODevice::WriteOnly) || !picture.save(&buffer, "PNG"))
        return Error{ErrorCode::out_of_memory, path.string() + ": there is no memory for the picture."};
    return write_file(path, std::string_view(bytes.constData(), static_cast<std::size_t>(bytes.size())));
}

/// The words of a line: separated by spaces, "in quotes" where they hold some. A # begins a comment.
QStringList words_of(const QString& line) {
    QStringList words;
    QString word;
    bool quoted = false, has_word = false;
    for (const QChar c : line) {
        if (c == '"') {
            quoted = !quoted;
            has_word = true;
        } else if (!quoted && c == '#') {
            break;
        } else if (!quoted && c.isSpace()) {
            if (has_word) words << word;
            word.clear();
            has_word = false;
        } else {
            word += c;
            has_word = true;
        }
    }
    if (has_word) words << word;
    return words;
}

Result<double> number_within(const QString& text, double least, double most) {
    bool ok = false;
    const double number = text.toDouble(&ok);
    if (!ok) return usage("'" + text + "' is no number.");
    if (number >= least && number <= most) return number;
    return usage(QString("%1 is out of range; from %2 to %3 is allowed.").arg(text).arg(least).arg(most));
}

class Script {
public:
    Script(std::filesystem::path folder, MainWindow& window) : folder_(std::move(folder)), window_(window) {}

    Status run(const QStringList& words) {
        const QString& name = words[0];
        const auto known = commands().find(name);
        if (known == commands().end()) return usage("there is no command '" + name + "'.");
        const auto& [least, most, run] = known->second;
        const int count = static_cast<int>(words.size()) - 1;
        if (count < least || count > most)
            return usage("'" + name + "' takes " +
                         (least == most ? QString::number(least) : QString("%1 to %2").arg(least).arg(most)) +
                         " words, and " + QString::number(count) + " are there.");
        return run(*this, words.mid(1));
    }

private:
    struct Command {
        int least, most; ///< words after the name
        std::function<Status(Script&, const QStringList&)> run;
    };
    static const std::map<QString, Command>& commands();
    static Command file_command(void (Workbench::*work)(const std::string&)) {
        return {1, 1, [work](Script& s, const QStringList& w) {
                    return s.settle_well([&] { (s.workbench().*work)(s.path(w[0])); });
                }};
    }

    /// Whether the last word says that nothing is waited for.
    static Result<bool> parse_now(const QStringList& words) {
        if (words.size() == 1) return false;
        if (words[1] == "now") return true;
        return usage("'" + words[1] + "' means nothing here; there is 'now'.");
    }
    Status open(const QStringList& words) {
        const Result<bool> now = parse_now(words);
        if (!now) return now.error();
        const auto work = [&] { workbench().open(path(words[0])); };
        if (!*now) return settle_well(work);
        work();
        return Success{};
    }
    Status screenshot(const QStringList& words) {
        const Result<bool> now = parse_now(words);
        if (!now) return now.error();
        return *now ? grab_window(path(words[0]), window_) : save_screenshot(path(words[0]), window_);
    }
    Status attempt(const QStringList& words) {
        (void)run(words); // what it fails with is in the message bar, to be looked at
        return Success{};
    }

    std::string path(const QString& text) const { return (folder_ / text.toStdString()).string(); }
    Workbench& workbench() { return window_.workbench(); }

    /// Until all that was begun is done. Errors that the window told are the script's.
    Status settle() {
        if (!wait_until_still(window_, kPatience)) return usage("the window is still at work after ten minutes.");
        return Success{};
    }
    Status wait_for(const QString& text) {
        const Result<double> seconds = number_within(text, 0, kPatience);
        if (!seconds) return seconds.error();
        QElapsedTimer clock;
        clock.start();
        while (double(clock.elapsed()) < 1000 * *seconds) handle_events();
        return Success{};
    }
    Status settle_well(const std::function<void()>& work) {
        ErrorWatch watch(workbench());
        work();
        if (Status still = settle(); !still) return still;
        return watch.take();
    }

    Status do_action(const QString& name) {
        QAction* const action = window_.actions().find(name);
        if (!action) return usage("there is no action '" + name + "'.");
        if (!action->isEnabled()) return usage("the action '" + name + "' can do nothing now.");
        action->trigger();
        handle_events();
        return Success{};
    }

    Result<QWidget*> control(const QString& name) {
        // A slider has a number beside it, which takes values in their unit.
        if (auto* const number = window_.findChild<QWidget*>(name + ".number")) return number;
        if (auto* const widget = window_.findChild<QWidget*>(name)) return widget;
        return usage("there is no control '" + name + "'.");
    }

    Status set(const QString& name, const QString& value) {
        Result<QWidget*> found = control(name);
        if (!found) return found.error();
        if (!(*found)->isEnabled()) return usage("the control '" + name + "' cannot be changed now.");
        if (auto* const number = qobject_cast<QDoubleSpinBox*>(*found)) {
            const Result<double> to = number_within(value, number->minimum(), number->maximum());
            if (!to) return to.error();
            number->setValue(*to);
        } else if (auto* const slider = qobject_cast<QAbstractSlider*>(*found)) {
            const Result<double> to = number_within(value, slider->minimum(), slider->maximum());
            if (!to) return to.error();
            slider->setValue(int(*to));
        } else if (auto* const button = qobject_cast<QAbstractButton*>(*found); button && button->isCheckable()) {
            if (value != "on" && value != "off") return usage("'" + value + "' is neither on nor off.");
            if (button->isChecked() != (value == "on")) button->click();
        } else if (auto* const choice = qobject_cast<QComboBox*>(*found)) {
            const int index = choice->findText(value, Qt::MatchFixedString);
            if (index < 0) return usage("'" + name + "' has no choice '" + value + "'.");
            choice->setCurrentIndex(index);
            Q_EMIT choice->activated(index);
        } else {
            return usage("'" + name + "' is no control that takes a value.");
        }
        handle_events();
        return Success{};
    }

    Status expect(const QString& name, const QString& value) {
        if (name == "message")
            return window_.message().contains(value)
                       ? Status(Success{})
                       : usage("the message is '" + window_.message() + "', not '" + value + "'.");
        Result<QWidget*> found = control(name);
        if (!found) return found.error();
        const QString is = value_of(**found);
        const bool is_number = qobject_cast<QDoubleSpinBox*>(*found) != nullptr;
        const bool is_equal = is_number ? std::abs(is.toDouble() - value.toDouble()) < 1e-6 : is == value;
        return is_equal ? Status(Success{}) : usage("'" + name + "' is '" + is + "', not '" + value + "'.");
    }
    static QString value_of(const QWidget& control) {
        if (const auto* number = qobject_cast<const QDoubleSpinBox*>(&control))
            return QString::number(number->value(), 'g', 15);
        if (const auto* slider = qobject_cast<const QAbstractSlider*>(&control))
            return QString::number(slider->value());
        if (const auto* button = qobject_cast<const QAbstractButton*>(&control))
            return button->isChecked() ? "on" : "off";
        const auto* choice = qobject_cast<const QComboBox*>(&control);
        return choice ? choice->currentText() : QString();
    }

    Result<QPointF> place(const QString& x, const QString& y) {
        bool x_ok = false, y_ok = false;
        const double u = x.toDouble(&x_ok), v = y.toDouble(&y_ok);
        if (!x_ok || !y_ok || !(u >= 0 && u <= 1 && v >= 0 && v <= 1))
            return usage("'" + x + " " + y +
                         "' is no place; write two fractions of the picture's width and height, from 0 to 1.");
        const Viewport& viewport = window_.viewport();
        return QPointF(u * (viewport.width() - 1), v * (viewport.height() - 1));
    }

    void send_mouse(QEvent::Type type, const QPointF& at, Qt::MouseButton button, Qt::MouseButtons held) {
        Viewport& viewport = window_.viewport();
        QMouseEvent event(type, at, viewport.mapToGlobal(at), button, held, Qt::NoModifier);
        QCoreApplication::sendEvent(&viewport, &event);
        handle_events();
    }

    Result<Qt::MouseButton> parse_button(const QStringList& words, int at) {
        const QString name = words.value(at, "left");
        if (name == "left") return Qt::LeftButton;
        if (name == "right") return Qt::RightButton;
        if (name == "middle") return Qt::MiddleButton;
        return usage("'" + name + "' is no mouse button; there are left, right and middle.");
    }

    Status press(const QStringList& words) {
        const Result<QPointF> at = place(words[0], words[1]);
        if (!at) return at.error();
        const Result<Qt::MouseButton> button = parse_button(words, 2);
        if (!button) return button.error();
        held_ = *button;
        last_ = *at;
        send_mouse(QEvent::MouseMove, *at, Qt::NoButton, Qt::NoButton);
        send_mouse(QEvent::MouseButtonPress, *at, held_, held_);
        return Success{};
    }

    Status move(const QStringList& words) {
        const Result<QPointF> to = place(words[0], words[1]);
        if (!to) return to.error();
        constexpr int kSteps = 12; // as a hand would
        for (int i = 1; i <= kSteps; ++i)
            send_mouse(QEvent::MouseMove, last_ + (*to - last_) * (double(i) / kSteps), Qt::NoButton, held_);
        last_ = *to;
        return Success{};
    }

    Status release() {
        send_mouse(QEvent::MouseButtonRelease, last_, held_, Qt::NoButton);
        held_ = Qt::NoButton;
        return Success{};
    }

    Status drag(const QStringList& words) {
        QStringList from = words.mid(0, 2);
        if (words.size() > 4) from << words[4];
        if (Status status = press(from); !status) return status;
        if (Status status = move(words.mid(2, 2)); !status) return status;
        return release();
    }

    Status wheel(const QStringList& words) {
        const Result<QPointF> at = place(words[0], words[1]);
        if (!at) return at.error();
        bool ok = false;
        const int notches = words[2].toInt(&ok);
        if (!ok) return usage("'" + words[2] + "' is no number of notches.");
        Viewport& viewport = window_.viewport();
        constexpr int kNotch = 120; // eighths of a degree
        for (int i = 0; i < std::abs(notches); ++i) {
            QWheelEvent event(*at, viewport.mapToGlobal(*at), {}, {0, notches > 0 ? kNotch : -kNotch}, Qt::NoButton,
                              Qt::NoModifier, Qt::NoScrollPhase, false);
            QCoreApplication::sendEvent(&viewport, &event);
            handle_events();
        }
        return Success{};
    }

    Status key(const QString& text) {
        const QKeySequence keys(text);
        if (keys.isEmpty()) return usage("'" + text + "' is no key.");
        for (QAction* const action : window_.actions().all())
            if (action->isEnabled() && action->shortcuts().contains(keys)) {
                action->trigger();
                handle_events();
                return Success{};
            }
        return usage("no action listens to '" + text + "' now.");
    }

    Status frames(const QString& text) {
        bool ok = false;
        const unsigned count = text.toUInt(&ok);
        if (!ok || count == 0) return usage("'" + text + "' is no number of frames.");
        return simulate_frames(count, window_);
    }

    std::filesystem::path folder_;
    MainWindow& window_;
    Qt::MouseButton held_ = Qt::NoButton;
    QPointF last_;
};

const std::map<QString, Script::Command>& Script::commands() {
    using Words = const QStringList&;
    static const std::map<QString, Command> table = {
        {"open", {1, 2, [](Script& s, Words w) { return s.open(w); }}},
        {"save", file_command(&Workbench::save_model)},
        {"save_mesh", file_command(&Workbench::save_mesh)},
        {"save_driver", file_command(&Workbench::save_driver)},
        {"export_meshes", file_command(&Workbench::export_meshes)},
        {"open_motion",
         {1, 1, [](Script& s, Words w) { return s.settle_well([&] { s.workbench().open_motion(s.path(w[0])); }); }}},
        {"save_packed", file_command(&Workbench::save_packed)},
        {"export_animation", file_command(&Workbench::export_animation)},
        {"export_film",
         {1, 1,
          [](Script& s, Words w) { return s.settle_well([&] { s.workbench().export_film(s.path(w[0]), {}); }); }}},
        {"dismiss",
         {0, 0,
          [](Script& s, Words) {
              s.window_.dismiss_message();
              return Status(Success{});
          }}},
        {"panel",
         {1, 1,
          [](Script& s, Words w) {
              return s.window_.show_panel(w[0]) ? Status(Success{}) : usage("there is no panel '" + w[0] + "'.");
          }}},
        {"do", {1, 1, [](Script& s, Words w) { return s.do_action(w[0]); }}},
        {"set", {2, 2, [](Script& s, Words w) { return s.set(w[0], w[1]); }}},
        {"expect", {2, 2, [](Script& s, Words w) { return s.expect(w[0], w[1]); }}},
        {"key", {1, 1, [](Script& s, Words w) { return s.key(w[0]); }}},
        {"press", {2, 3, [](Script& s, Words w) { return s.press(w); }}},
        {"move", {2, 2, [](Script& s, Words w) { return s.move(w); }}},
        {"release", {0, 0, [](Script& s, Words) { return s.release(); }}},
        {"drag", {4, 5, [](Script& s, Words w) { return s.drag(w); }}},
        {"wheel", {3, 3, [](Script& s, Words w) { return s.wheel(w); }}},
        {"frames", {1, 1, [](Script& s, Words w) { return s.frames(w[0]); }}},
        {"wait", {0, 1, [](Script& s, Words w) { return w.isEmpty() ? s.settle() : s.wait_for(w[0]); }}},
        {"screenshot", {1, 2, [](Script& s, Words w) { return s.screenshot(w); }}},
        {"try", {1, 8, [](Script& s, Words w) { return s.attempt(w); }}},
    };
    return table;
}

} // namespace

void prepare_application() {
    std::signal(SIGXFSZ, SIG_IGN); // a file that may not grow fails like a full disk, and is told of
    QCoreApplication::setApplicationName("filigree-studio");
    QCoreApplication::setOrganizationName("filigree");
    QCoreApplication::setApplicationVersion(FILIGREE_VERSION);
    QSurfaceFormat format;
    format.setVersion(4, 3);
    format.setProfile(QSurfaceFormat::CoreProfile);
    format.setDepthBufferSize(0); // the renderer brings its own
    format.setStencilBufferSize(8);
    QSurfaceFormat::setDefaultFormat(format);
    QCoreApplication::setAttribute(Qt::AA_ShareOpenGLContexts);
}

ErrorWatch::ErrorWatch(Workbench& workbench) {
    QObject::connect(&workbench.jobs(), &Jobs::failed, &receiver_, [this](const Error& error) { last_ = error; });
}

Status ErrorWatch::take() {
    if (!last_) return Success{};
    return *std::exchange(last_, std::nullopt);
}

bool wait_until_still(MainWindow& window, double seconds) {
    QElapsedTimer clock;
    clock.start();
    for (int quiet = 0; quiet < 3;) { // what ends may begin something else
        if (double(clock.elapsed()) > 1000 * seconds) return false;
        window.workbench().wait_until_idle();
        handle_events();
        quiet = window.workbench().jobs().is_busy() || !window.viewport().is_ready() ? 0 : quiet + 1;
    }
    return true;
}

Status simulate_frames(unsigned frames, MainWindow& window) {
    Workbench& workbench = window.workbench();
    ErrorWatch watch(workbench);
    workbench.set_mode(Mode::body);
    if (workbench.frame_count() == 0) workbench.make_body();
    workbench.wait_until_idle();
    if (Status made = watch.take(); !made) return made;
    for (unsigned i = 0; i < frames; ++i) {
        const std::size_t before = workbench.frame();
        workbench.step();
        workbench.playback().wait_for_frames(1);
        if (workbench.frame() == before)
            return Error{ErrorCode::unsuitable, "The body does not move: " + window.message().toStdString()};
    }
    return Success{};
}

Status save_screenshot(const std::filesystem::path& path, MainWindow& window) {
    if (!wait_until_still(window, kPatience))
        return Error{ErrorCode::unsuitable, path.string() + ": the window was not still after ten minutes."};
    window.viewport().finish_drawing();
    handle_events();
    return grab_window(path, window);
}

std::string script_names(MainWindow& window) {
    QString text;
    const auto row = [&](const QString& name, const QString& is) { text += name.leftJustified(26) + ' ' + is + '\n'; };
    text += "do ACTION\n";
    for (const QAction* action : window.actions().all())
        if (!action->menu()) row("  " + action->objectName(), QString(action->text()).remove('&'));
    text += "set CONTROL VALUE, expect CONTROL VALUE\n";
    QStringList known;
    for (const QWidget* widget : window.findChildren<QWidget*>()) {
        QString name = widget->objectName();
        if (name.endsWith(".number")) name.chop(7); // stands for its slider
        const auto* button = qobject_cast<const QAbstractButton*>(widget);
        const bool takes_values = qobject_cast<const QAbstractSlider*>(widget) ||
                                  qobject_cast<const QAbstractSpinBox*>(widget) ||
                                  qobject_cast<const QComboBox*>(widget) || (button && button->isCheckable());
        if (!takes_values || !name.contains('.') || known.contains(name)) continue;
        known << name;
        row("  " + name, widget->toolTip().section('\n', 0, 0));
    }
    return text.toStdString();
}

Status run_script(const std::filesystem::path& path, MainWindow& window) {
    Result<std::string> text = read_file(path);
    if (!text) return text.error();
    Script script(path.parent_path(), window);
    const QStringList lines = QString::fromStdString(*text).split('\n');
    for (qsizetype i = 0; i < lines.size(); ++i) {
        const QStringList words = words_of(lines[i]);
        if (words.isEmpty()) continue;
        const Status status = script.run(words);
        if (status) continue;
        Error error = status.error();
        error.message = path.string() + ":" + std::to_string(i + 1) + ": " + error.message;
        return error;
    }
    return Success{};
}

} // namespace filigree::studio
