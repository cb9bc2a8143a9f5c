#include "icons.h"

#include "theme.h"

#include <QGuiApplication>
#include <QIconEngine>
#include <QPainter>
#include <QPainterPath>
#include <QPalette>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace filigree::studio {
namespace {

/// What a stroke's numbers are, in a square of 16 by 16, y down. Angles in degrees, counter-clockwise, 0: right.
enum class Kind {
    line,    ///< x, y of two points or more
    polygon, ///< the same, closed
    solid,   ///< the same, filled
    ellipse, ///< x, y of the middle, radius
    arc,     ///< x, y, width, height of the whole ellipse's box, first angle, angle from there
    box,     ///< x, y, width, height
    bar,     ///< the same, filled
    dot,     ///< x, y
    curve,   ///< x, y of the start, then of three points for each cubic
    head,    ///< of an arrow: x, y of its tip, the angle it points along, length
    cube,    ///< x, y of the middle, radius
};
struct Stroke {
    Kind kind;
    std::vector<double> numbers;
};

const std::vector<Stroke>& strokes_of(Icon kind) {
    using enum Kind;
    static const std::map<Icon, std::vector<Stroke>> table = {
        {Icon::open,
         {{line, {2, 13, 2, 3.5, 6, 3.5, 7.5, 5.5, 12.5, 5.5, 12.5, 7.5}},
          {polygon, {2, 13, 4.5, 7.5, 14.5, 7.5, 12, 13}}}},
        {Icon::save,
         {{polygon, {2.5, 2.5, 11, 2.5, 13.5, 5, 13.5, 13.5, 2.5, 13.5}},
          {box, {5, 9, 6, 4.5}},
          {box, {5.5, 2.5, 4, 3}}}},
        {Icon::undo, {{arc, {3, 4.5, 10, 8.5, -80, 215}}, {head, {3.4, 7.2, 250, 3.8}}}},
        {Icon::redo, {{arc, {3, 4.5, 10, 8.5, 260, -215}}, {head, {12.6, 7.2, 290, 3.8}}}},
        {Icon::pull, // a surface that follows an arrow
         {{curve, {1.5, 13, 6, 13, 6, 8.5, 8, 8.5, 10, 8.5, 10, 13, 14.5, 13}},
          {line, {8, 6.2, 8, 1.8}},
          {head, {8, 1.6, 90, 3.4}}}},
        {Icon::pin, {{ellipse, {8, 5.2, 3.2}}, {line, {8, 8.4, 8, 13.6}}, {line, {4.5, 13.6, 11.5, 13.6}}}},
        {Icon::turn,
         {{ellipse, {8, 8, 2.2}},
          {arc, {2, 2, 12, 12, 20, 130}},
          {arc, {2, 2, 12, 12, 200, 130}},
          {head, {13.7, 6, 290, 3.2}},
          {head, {2.3, 10, 110, 3.2}}}},
        {Icon::torch, // a flame over its handle
         {{curve,
           {8, 1.5, 9, 4, 12, 5.5, 12, 8.5, 12, 11, 10, 12, 8, 12, 6, 12, 4, 11, 4, 8.5, 4, 6.5, 6.5, 5, 8, 1.5}},
          {line, {8, 12, 8, 15}},
          {line, {6, 15, 10, 15}}}},
        {Icon::play, {{solid, {4.5, 2.8, 13, 8, 4.5, 13.2}}}},
        {Icon::pause, {{bar, {3.8, 2.8, 3.1, 10.4}}, {bar, {9.1, 2.8, 3.1, 10.4}}}},
        {Icon::step, {{solid, {3, 3, 10, 8, 3, 13}}, {bar, {11.2, 2.6, 2.2, 10.8}}}},
        {Icon::reset, {{solid, {13, 3, 6, 8, 13, 13}}, {bar, {2.6, 2.6, 2.2, 10.8}}}},
        {Icon::minus, {{line, {3, 8, 13, 8}}}},
        {Icon::plus, {{line, {3, 8, 13, 8}}, {line, {8, 3, 8, 13}}}},
        {Icon::deform, // a bar, bent
         {{curve, {2, 12.5, 2, 4, 8, 2, 14, 3.5}},
          {line, {14, 3.5, 13, 7.5}},
          {curve, {13, 7.5, 9, 6.5, 6, 8, 6.2, 12.5}},
          {line, {6.2, 12.5, 2, 12.5}}}},
        {Icon::animate, // a ball that bounced
         {{line, {1.5, 14, 14.5, 14}},
          {ellipse, {11, 5, 2.6}},
          {arc, {-4.5, 3, 11, 22, 35, 50}},
          {arc, {6, 7, 6, 14, 130, 45}}}},
        {Icon::film,
         {{box, {2, 3, 12, 10}},
          {dot, {4.6, 5}},
          {dot, {8, 5}},
          {dot, {11.4, 5}},
          {dot, {4.6, 11}},
          {dot, {8, 11}},
          {dot, {11.4, 11}}}},
        {Icon::meshes, {{polygon, {2, 13, 5, 4, 9.5, 12}}, {polygon, {5, 4, 13.5, 5.5, 9.5, 12}}}},
        {Icon::show_all,
         {{cube, {8, 8, 3.6}},
          {line, {1.8, 4.6, 1.8, 1.8, 4.6, 1.8}},
          {line, {11.4, 1.8, 14.2, 1.8, 14.2, 4.6}},
          {line, {14.2, 11.4, 14.2, 14.2, 11.4, 14.2}},
          {line, {4.6, 14.2, 1.8, 14.2, 1.8, 11.4}}}},
        {Icon::close, {{line, {4, 4, 12, 12}}, {line, {12, 4, 4, 12}}}},
        {Icon::warning, {{polygon, {8, 2, 14.5, 13.5, 1.5, 13.5}}, {line, {8, 6.5, 8, 9.5}}, {dot, {8, 11.5}}}},
        {Icon::good, {{line, {3, 8.5, 6.5, 12, 13, 4}}}},
        {Icon::folded, {{line, {6, 4, 10, 8, 6, 12}}}},
        {Icon::unfolded, {{line, {4, 6, 8, 10, 12, 6}}}},
        {Icon::logo, {{cube, {8, 8, 6.8}}}},
    };
    return table.at(kind);
}

QPointF towards(double degrees, double length) {
    const double angle = degrees * std::numbers::pi / 180;
    return QPointF(std::cos(angle), -std::sin(angle)) * length;
}

void draw(QPainter& painter, const Stroke& stroke, const QColor& color) {
    const std::vector<double>& n = stroke.numbers;
    QPolygonF points;
    for (std::size_t k = 0; k + 1 < n.size(); k += 2) points << QPointF(n[k], n[k + 1]);
    switch (stroke.kind) {
    case Kind::line:
        return painter.drawPolyline(points);
    case Kind::polygon:
        return painter.drawPolygon(points);
    case Kind::solid:
        painter.setBrush(color);
        painter.drawPolygon(points);
        return painter.setBrush(Qt::NoBrush);
    case Kind::ellipse:
        return painter.drawEllipse(points[0], n[2], n[2]);
    case Kind::arc:
        return painter.drawArc(QRectF(n[0], n[1], n[2], n[3]), int(16 * n[4]), int(16 * n[5]));
    case Kind::box:
        return painter.drawRect(QRectF(n[0], n[1], n[2], n[3]));
    case Kind::bar:
        return painter.fillRect(QRectF(n[0], n[1], n[2], n[3]), color);
    case Kind::dot:
        return painter.drawPoint(points[0]);
    case Kind::curve: {
        QPainterPath path(points[0]);
        for (qsizetype k = 1; k + 2 < points.size(); k += 3) path.cubicTo(points[k], points[k + 1], points[k + 2]);
        return painter.drawPath(path);
    }
    case Kind::head:
        for (const double side : {150.0, -150.0}) painter.drawLine(points[0], points[0] + towards(n[2] + side, n[3]));
        return;
    case Kind::cube:
        points.clear();
        for (int k = 0; k < 6; ++k) points << QPointF(n[0], n[1]) + towards(30 + 60 * k, n[2]);
        painter.drawPolygon(points);
        for (const int k : {0, 2, 4}) painter.drawLine(QPointF(n[0], n[1]), points[k]);
    }
}

class DrawnIcon : public QIconEngine {
public:
    explicit DrawnIcon(Icon kind) : kind_(kind) {}

    void paint(QPainter* painter, const QRect& rect, QIcon::Mode mode, QIcon::State) override {
        const QPalette palette = QGuiApplication::palette();
        QColor color = palette.color(mode == QIcon::Disabled ? QPalette::Disabled : QPalette::Active,
                                     mode == QIcon::Selected ? QPalette::HighlightedText : QPalette::ButtonText);
        if (kind_ == Icon::good) color = good_color(palette);
        if (kind_ == Icon::warning) color = bad_color(palette);
        painter->save();
        painter->setRenderHint(QPainter::Antialiasing);
        const double side = std::min(rect.width(), rect.height());
        painter->translate(rect.center().x() + 0.5 - side / 2, rect.center().y() + 0.5 - side / 2);
        painter->scale(side / 16, side / 16);
        painter->setPen(QPen(color, 1.3, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
        painter->setBrush(Qt::NoBrush);
        for (const Stroke& stroke : strokes_of(kind_)) draw(*painter, stroke, color);
        painter->restore();
    }
    QPixmap pixmap(const QSize& size, QIcon::Mode mode, QIcon::State state) override {
        QPixmap picture(size);
        picture.fill(Qt::transparent);
        QPainter painter(&picture);
        paint(&painter, QRect(QPoint(0, 0), size), mode, state);
        return picture;
    }
    QIconEngine* clone() const override { return new DrawnIcon(kind_); }

private:
    Icon kind_;
};

} // namespace

QIcon icon(Icon kind) { return QIcon(new DrawnIcon(kind)); }

} // namespace filigree::studio
