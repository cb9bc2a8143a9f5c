// Light and dark: two palettes of our own over the Fusion style, and which of them holds.
#pragma once

#include <QColor>
#include <QPalette>

namespace filigree::studio {

/// system: light or dark as the desktop is, with its highlight colour.
enum class Theme { system, light, dark };

/// Sets style and palette of the whole application.
void apply_theme(Theme theme);

bool is_dark(const QPalette& palette);
/// Text that says that all is well, or that something is not; readable on that palette's window colour.
QColor good_color(const QPalette& palette);
QColor bad_color(const QPalette& palette);
/// Text that may be overlooked, such as headings and hints.
QColor quiet_color(const QPalette& palette);

} // namespace filigree::studio
