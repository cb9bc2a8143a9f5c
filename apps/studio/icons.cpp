#include "icons.h"

#include "theme.h"

#include <QGuiApplication>
#include <QIconEngine>
#include <QPainter>
#include <QPainterPath>
#include <QPalette>

#include <numbers>

namespace filigree::studio {
namespace {

/// An arrow's head at `tip` that points along `degrees` (0: right, 90: up).
void draw_head(QPainter& painter, QPointF tip, double degrees, double length = 3.2) {
    for (const double side : {150.0, -150.0}) {
        const double angle = (degrees + side) * std::numbers::pi / 180;
        painter.drawLine(tip, tip + QPointF(std::cos(angle), -std::sin(angle)) * length);
    }
}

void draw_undo(QPainter& painter) {
    painter.drawArc(QRectF(3, 4.5, 10, 8.5), -80 * 16, 215 * 16);
    draw_head(painter, {3.4, 7.2}, 250, 3.8);
}

void draw_cube(QPainter& painter, QPointF centre, double radius) {
    QPolygonF outline;
    for (int k = 0; k < 6; ++k) {
        const double angle = (30 + 60 * k) * std::numbers::pi / 180;
        outline << centre + QPointF(std::cos(angle), -std::sin(angle)) * radius;
    }
    painter.drawPolygon(outline);
    for (const int k : {0, 2, 4}) painter.drawLine(centre, outline[k]);
}

/// In a square of 16 by 16, y down.
void draw(QPainter& painter, Icon kind, const QColor& color) {
    painter.setPen(QPen(color, 1.3, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
    painter.setBrush(Qt::NoBrush);
    const auto solid = [&](const QPolygonF& shape) {
        painter.setBrush(color);
        painter.drawPolygon(shape);
        painter.setBrush(Qt::NoBrush);
    };
    switch (kind) {
    case Icon::open:
        painter.drawPolyline(QPolygonF({{2, 13}, {2, 3.5}, {6, 3.5}, {7.5, 5.5}, {12.5, 5.5}, {12.5, 7.5}}));
        painter.drawPolygon(QPolygonF({{2, 13}, {4.5, 7.5}, {14.5, 7.5}, {12, 13}}));
        break;
    case Icon::save:
        painter.drawPolygon(QPolygonF({{2.5, 2.5}, {11, 2.5}, {13.5, 5}, {13.5, 13.5}, {2.5, 13.5}}));
        painter.drawRect(QRectF(5, 9, 6, 4.5));
        painter.drawRect(QRectF(5.5, 2.5, 4, 3));
        break;
    case Icon::undo:
        draw_undo(painter);
        break;
    case Icon::redo:
        painter.translate(16, 0);
        painter.scale(-1, 1);
        draw_undo(painter);
        break;
    case Icon::pull: { // a surface that follows an arrow
        QPainterPath surface({1.5, 13});
        surface.cubicTo({6, 13}, {6, 8.5}, {8, 8.5});
        surface.cubicTo({10, 8.5}, {10, 13}, {14.5, 13});
        painter.drawPath(surface);
        painter.drawLine(QPointF(8, 6.2), QPointF(8, 1.8));
        draw_head(painter, {8, 1.6}, 90, 3.4);
        break;
    }
    case Icon::pin:
        painter.drawEllipse(QPointF(8, 5.2), 3.2, 3.2);
        painter.drawLine(QPointF(8, 8.4), QPointF(8, 13.6));
        painter.drawLine(QPointF(4.5, 13.6), QPointF(11.5, 13.6));
        break;
    case Icon::turn:
        painter.drawEllipse(QPointF(8, 8), 2.2, 2.2);
        painter.drawArc(QRectF(2, 2, 12, 12), 20 * 16, 130 * 16);
        painter.drawArc(QRectF(2, 2, 12, 12), 200 * 16, 130 * 16);
        draw_head(painter, {13.7, 6}, 290);
        draw_head(painter, {2.3, 10}, 110);
        break;
    case Icon::play:
        solid({{{4.5, 2.8}, {13, 8}, {4.5, 13.2}}});
        break;
    case Icon::pause:
        painter.fillRect(QRectF(3.8, 2.8, 3.1, 10.4), color);
        painter.fillRect(QRectF(9.1, 2.8, 3.1, 10.4), color);
        break;
    case Icon::step:
        solid({{{3, 3}, {10, 8}, {3, 13}}});
        painter.fillRect(QRectF(11.2, 2.6, 2.2, 10.8), color);
        break;
    case Icon::reset:
        solid({{{13, 3}, {6, 8}, {13, 13}}});
        painter.fillRect(QRectF(2.6, 2.6, 2.2, 10.8), color);
        break;
    case Icon::minus:
        painter.drawLine(QPointF(3, 8), QPointF(13, 8));
        break;
    case Icon::plus:
        painter.drawLine(QPointF(3, 8), QPointF(13, 8));
        painter.drawLine(QPointF(8, 3), QPointF(8, 13));
        break;
    case Icon::deform: { // a bar, bent
        QPainterPath bar({2, 12.5});
        bar.cubicTo({2, 4}, {8, 2}, {14, 3.5});
        bar.lineTo(13, 7.5);
        bar.cubicTo({9, 6.5}, {6, 8}, {6.2, 12.5});
        bar.closeSubpath();
        painter.drawPath(bar);
        break;
    }
    case Icon::animate: // a ball that bounced
        painter.drawLine(QPointF(1.5, 14), QPointF(14.5, 14));
        painter.drawEllipse(QPointF(11, 5), 2.6, 2.6);
        painter.drawArc(QRectF(-4.5, 3, 11, 22), 35 * 16, 50 * 16);
        painter.drawArc(QRectF(6, 7, 6, 14), 130 * 16, 45 * 16);
        break;
    case Icon::film:
        painter.drawRect(QRectF(2, 3, 12, 10));
        for (const double x : {4.6, 8.0, 11.4}) {
            painter.drawPoint(QPointF(x, 5));
            painter.drawPoint(QPointF(x, 11));
        }
        break;
    case Icon::meshes:
        painter.drawPolygon(QPolygonF({{2, 13}, {5, 4}, {9.5, 12}}));
        painter.drawPolygon(QPolygonF({{5, 4}, {13.5, 5.5}, {9.5, 12}}));
        break;
    case Icon::show_all:
        draw_cube(painter, {8, 8}, 3.6);
        for (int k = 0; k < 4; ++k) {
            painter.drawPolyline(QPolygonF({{1.8, 4.6}, {1.8, 1.8}, {4.6, 1.8}}));
            painter.translate(16, 0);
            painter.rotate(90);
        }
        break;
    case Icon::close:
        painter.drawLine(QPointF(4, 4), QPointF(12, 12));
        painter.drawLine(QPointF(12, 4), QPointF(4, 12));
        break;
    case Icon::warning:
        painter.drawPolygon(QPolygonF({{8, 2}, {14.5, 13.5}, {1.5, 13.5}}));
        painter.drawLine(QPointF(8, 6.5), QPointF(8, 9.5));
        painter.drawPoint(QPointF(8, 11.5));
        break;
    case Icon::good:
        painter.drawPolyline(QPolygonF({{3, 8.5}, {6.5, 12}, {13, 4}}));
        break;
    case Icon::folded:
        painter.drawPolyline(QPolygonF({{6, 4}, {10, 8}, {6, 12}}));
        break;
    case Icon::unfolded:
        painter.drawPolyline(QPolygonF({{4, 6}, {8, 10}, {12, 6}}));
        break;
    case Icon::logo:
        draw_cube(painter, {8, 8}, 6.8);
        break;
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
        draw(*painter, kind_, color);
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
