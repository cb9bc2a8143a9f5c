#include "theme.h"

#include <QApplication>
#include <QProxyStyle>
#include <QStyle>
#include <QStyleFactory>

namespace filigree::studio {
namespace {

/// Nine tabs fit the column.
class NarrowTabs : public QProxyStyle {
public:
    using QProxyStyle::QProxyStyle;
    int pixelMetric(PixelMetric metric, const QStyleOption* option, const QWidget* widget) const override {
        constexpr int kTabSpace = 6; // beside a tab's text, both sides together
        return metric == PM_TabBarTabHSpace ? kTabSpace : QProxyStyle::pixelMetric(metric, option, widget);
    }
};

struct Shades {
    QColor window, base, alternate, button, text, disabled, line, highlight, link;
};

QPalette palette_of(const Shades& s) {
    QPalette palette(s.text, s.button, s.button.lighter(120), s.line.darker(140), s.line, s.text, Qt::white, s.base,
                     s.window);
    palette.setColor(QPalette::AlternateBase, s.alternate);
    palette.setColor(QPalette::ToolTipBase, s.alternate);
    palette.setColor(QPalette::ToolTipText, s.text);
    palette.setColor(QPalette::PlaceholderText, s.disabled);
    palette.setColor(QPalette::Highlight, s.highlight);
    palette.setColor(QPalette::HighlightedText, Qt::white);
    palette.setColor(QPalette::Link, s.link);
    for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
        palette.setColor(QPalette::Disabled, role, s.disabled);
    palette.setColor(QPalette::Disabled, QPalette::Highlight, s.line);
    palette.setColor(QPalette::Disabled, QPalette::HighlightedText, s.disabled);
    palette.setColor(QPalette::Disabled, QPalette::Base, s.window);
    return palette;
}

const Shades kLight = {"#f1f2f4", "#ffffff", "#f7f8f9", "#f8f9fa", "#1c2026",
                       "#8b919a", "#c3c8cf", "#2667c9", "#1d56ad"};
const Shades kDark = {"#2b2e34", "#1a1c1f", "#2c3036", "#363a41", "#e4e7eb",
                      "#7f868f", "#191b1f", "#3574d6", "#8ab4f8"};

} // namespace

bool is_dark(const QPalette& palette) {
    return palette.color(QPalette::Window).lightness() < palette.color(QPalette::WindowText).lightness();
}

QColor good_color(const QPalette& palette) { return is_dark(palette) ? "#7bd497" : "#16693a"; }
QColor bad_color(const QPalette& palette) { return is_dark(palette) ? "#ff9d92" : "#a3261a"; }
QColor quiet_color(const QPalette& palette) { return is_dark(palette) ? "#a6adb6" : "#565d67"; }

void apply_theme(Theme theme) {
    if (!dynamic_cast<NarrowTabs*>(QApplication::style()))
        QApplication::setStyle(new NarrowTabs(QStyleFactory::create(QStringLiteral("Fusion"))));
    QApplication::setPalette(QPalette()); // the desktop's, to see what it is
    const QPalette desktop = QApplication::palette();
    const bool dark = theme == Theme::dark || (theme == Theme::system && is_dark(desktop));
    QPalette palette = palette_of(dark ? kDark : kLight);
    if (theme == Theme::system && desktop.color(QPalette::Highlight).saturation() > 100) {
        const QColor highlight = desktop.color(QPalette::Highlight);
        if (highlight.lightness() < 150) palette.setColor(QPalette::Active, QPalette::Highlight, highlight);
    }
    QApplication::setPalette(palette);
}

} // namespace filigree::studio
