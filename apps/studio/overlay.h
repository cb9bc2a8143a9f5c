// What is written and drawn over the picture: hints, captions, legends, handles, and the sentence instead of a picture.
#pragma once

#include "shown_model.h"

#include "filigree/present/warp_gizmo.h"

#include <QPolygonF>
#include <QWidget>

#include <array>

namespace filigree::studio {

/// All places in device-independent pixels of the widget.
struct OverlayContent {
    std::string trouble; ///< not empty: there is no picture, and this is written instead
    QString hint;        ///< at the bottom, as visible as `hint_strength` (0 to 1)
    double hint_strength = 0;
    QString note;    ///< in the upper left corner: the level by distance, what is being prepared
    QString warning; ///< above the axes, in place of the hint: what is wrong with the shape as it is shown
    struct Caption {
        QString title, detail;
        QRectF tile;
        bool operator==(const Caption&) const = default;
    };
    std::vector<Caption> captions; ///< of the tiles; separators stand between them
    struct Legend {
        QString title, unit;
        ColorMap map = ColorMap::sequential;
        ValueRange range;
        double per_value = 1; ///< what is written: the value times this
        bool whole = false;   ///< whole numbers
        bool operator==(const Legend& other) const {
            return title == other.title && unit == other.unit && map == other.map && range.least == other.range.least &&
                   range.most == other.range.most && per_value == other.per_value && whole == other.whole;
        }
    };
    std::optional<Legend> legend;
    std::array<QPointF, 3> triad = {};      ///< where x, y and z point on screen, unit vectors foreshortened
    std::array<double, 3> triad_depth = {}; ///< larger: nearer
    bool shows_triad = false;
    std::vector<QPointF> pins;
    std::optional<QPointF> hover; ///< the middle of what would be grabbed
    double hover_radius = 0;
    std::optional<QLineF> pull; ///< from the point held to the pointer
    struct Knob {
        WarpKind part;
        QPolygonF line;
        QPointF at;
        bool has_tip = false, is_hot = false;
        QString label;
        bool operator==(const Knob&) const = default;
    };
    std::vector<Knob> knobs;
    struct Edge {
        QLineF line;                              ///< without length: a dot, a face without area
        bool is_open = false, is_opposed = false; ///< neither: non-manifold
        bool operator==(const Edge&) const = default;
    };
    std::vector<Edge> defects;
    QString defect_summary;
    bool operator==(const OverlayContent&) const = default;
};

/// A transparent child that covers the viewport and lets the mouse through: painted by the processor, so antialiased on
/// any OpenGL, and there without any.
class Overlay : public QWidget {
public:
    explicit Overlay(QWidget* parent);
    void set(OverlayContent content);
    void set_covered(int height); ///< by something else over the top: what stands there begins below
    const OverlayContent& content() const { return content_; }

protected:
    void paintEvent(QPaintEvent* event) override;

private:
    OverlayContent content_;
    int covered_ = 0;
};

} // namespace filigree::studio
