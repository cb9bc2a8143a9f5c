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

namespace filigree::studio {
namespace {

const std::vector<Stroke>& strokes_of(Icon kind) {
    using enum StrokeKind;
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
    case StrokeKind::line:
        return painter.drawPolyline(points);
    case StrokeKind::polygon:
        return painter.drawPolygon(points);
    case StrokeKind::solid:
        painter.setBrush(color);
        painter.drawPolygon(points);
        return painter.setBrush(Qt::NoBrush);
    case StrokeKind::ellipse:
        return painter.drawEllipse(points[0], n[2], n[2]);
    case StrokeKind::arc:
        return painter.drawArc(QRectF(n[0], n[1], n[2], n[3]), int(16 * n[4]), int(16 * n[5]));
    case StrokeKind::box:
        return painter.drawRect(QRectF(n[0], n[1], n[2], n[3]));
    case StrokeKind::bar:
        return painter.fillRect(QRectF(n[0], n[1], n[2], n[3]), color);
    case StrokeKind::dot:
        return painter.drawPoint(points[0]);
    case StrokeKind::curve: {
        QPainterPath path(points[0]);
        for (qsizetype k = 1; k + 2 < points.size(); k += 3) path.cubicTo(points[k], points[k + 1], points[k + 2]);
        return painter.drawPath(path);
    }
    case StrokeKind::head:
        for (const double side : {150.0, -150.0}) painter.drawLine(points[0], points[0] + towards(n[2] + side, n[3]));
        return;
    case StrokeKind::cube:
        points.clear();
        for (int k = 0; k < 6; ++k) points << QPointF(n[0], n[1]) + towards(30 + 60 * k, n[2]);
        painter.drawPolygon(points);
        for (const int k : {0, 2, 4}) painter.drawLine(QPointF(n[0], n[1]), points[k]);
    }
}

class DrawnIcon : public QIconEngine {
public:
    /// color: of a palette; null: that of buttons' texts.
    explicit DrawnIcon(const std::vector<Stroke>& strokes, QColor (*color)(const QPalette&) = nullptr)
        : strokes_(strokes), color_(color) {}

    void paint(QPainter* painter, const QRect& rect, QIcon::Mode mode, QIcon::State) override {
        const QPalette palette = QGuiApplication::palette();
        QColor color = palette.color(mode == QIcon::Disabled ? QPalette::Disabled : QPalette::Active,
                                     mode == QIcon::Selected ? QPalette::HighlightedText : QPalette::ButtonText);
        if (color_) color = color_(palette);
        painter->save();
        painter->setRenderHint(QPainter::Antialiasing);
        const double side = std::min(rect.width(), rect.height());
        painter->translate(rect.center().x() + 0.5 - side / 2, rect.center().y() + 0.5 - side / 2);
        painter->scale(side / 16, side / 16);
        painter->setPen(QPen(color, 1.3, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
        painter->setBrush(Qt::NoBrush);
        for (const Stroke& stroke : strokes_) draw(*painter, stroke, color);
        painter->restore();
    }
    QPixmap pixmap(const QSize& size, QIcon::Mode mode, QIcon::State state) override {
        QPixmap picture(size);
        picture.fill(Qt::transparent);
        QPainter painter(&picture);
        paint(&painter, QRect(QPoint(0, 0), size), mode, state);
        return picture;
    }
    QIconEngine* clone() const override { return new DrawnIcon(strokes_, color_); }

private:
    const std::vector<Stroke>& strokes_;
    QColor (*color_)(const QPalette&);
};

} // namespace

QIcon icon(Icon kind) {
    const auto color = kind == Icon::good ? good_color : kind == Icon::warning ? bad_color : nullptr;
    return QIcon(new DrawnIcon(strokes_of(kind), color));
}

QIcon icon(const std::vector<Stroke>& strokes) { return QIcon(new DrawnIcon(strokes)); }

} // namespace filigree::studio
