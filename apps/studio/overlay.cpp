#include "overlay.h"

#include "theme.h"

#include <QPainter>

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr double kMargin = 14; // from the widget's borders
constexpr double kTriad = 70;  // the axes take, from the margins in the corner

constexpr double kWarningWidth = 340; // wider is hard to read over a picture

const QColor kWarning(217, 138, 20), kPin(226, 74, 51), kOpen(235, 94, 40), kNonManifold(190, 50, 200),
    kOpposed(20, 110, 220), kFlat(150, 110, 0);
const std::array<QColor, 3> kAxes = {QColor(214, 69, 65), QColor(76, 160, 72), QColor(62, 116, 214)};

/// A colour for each handle, in the order of WarpKind: stretch, squeeze, bend, twist, taper.
const std::array<QColor, 5> kGizmos = {QColor(217, 95, 48), QColor(44, 127, 184), QColor(49, 150, 84),
                                       QColor(136, 86, 167), QColor(196, 138, 20)};

/// The painter of one picture, with what the theme says.
class Sheet {
public:
    Sheet(QPainter& painter, const QPalette& palette, const QRectF& area)
        : painter_(painter), area_(area), is_dark_(is_dark(palette)), text_(palette.color(QPalette::WindowText)),
          plate_(palette.color(QPalette::Window)) {
        plate_.setAlphaF(is_dark_ ? 0.72f : 0.78f);
        painter.setRenderHint(QPainter::Antialiasing);
    }

    void trouble(const QString& sentence) {
        painter_.setPen(text_);
        const double margin = std::max(24.0, area_.width() * 0.15);
        painter_.drawText(area_.adjusted(margin, 0, -margin, 0), Qt::AlignCenter | Qt::TextWordWrap, sentence);
    }

    /// Text on a plate; returns the plate.
    QRectF label(const QPointF& at, const QString& text, Qt::Alignment alignment, double strength = 1) {
        const QFontMetricsF metrics(painter_.font());
        const QRectF bounds = metrics.boundingRect(QRectF(0, 0, 4000, 4000), Qt::AlignLeft, text);
        QRectF plate(0, 0, bounds.width() + 16, bounds.height() + 8);
        plate.moveTopLeft(at);
        if (alignment & Qt::AlignHCenter) plate.moveLeft(at.x() - plate.width() / 2);
        if (alignment & Qt::AlignRight) plate.moveLeft(at.x() - plate.width());
        if (alignment & Qt::AlignBottom) plate.moveTop(at.y() - plate.height());
        plate.moveTopLeft(QPointF(std::round(plate.left()), std::round(plate.top())));
        painter_.setOpacity(strength);
        painter_.setPen(Qt::NoPen);
        painter_.setBrush(plate_);
        painter_.drawRoundedRect(plate, 5, 5);
        painter_.setPen(text_);
        painter_.drawText(plate.adjusted(8, 4, -8, -4), Qt::AlignCenter, text);
        painter_.setOpacity(1);
        return plate;
    }

    /// A sentence in an amber frame above the axes (and the legend, where that is in its way), in as many lines as it
    /// needs.
    void warning(const QString& text, const QRectF& legend) {
        const double width = std::min(kWarningWidth, area_.width() - 2 * kMargin) - 16;
        const QRectF taken = painter_.boundingRect(QRectF(0, 0, width, 4000), Qt::AlignLeft | Qt::TextWordWrap, text);
        QRectF plate(0, 0, std::ceil(taken.width()) + 16, std::ceil(taken.height()) + 8);
        plate.moveBottomLeft({area_.left() + kMargin, area_.bottom() - kMargin - kTriad - 6});
        if (plate.intersects(legend)) plate.moveBottom(legend.top() - 6);
        painter_.setPen(QPen(kWarning, 1.5));
        painter_.setBrush(plate_);
        painter_.drawRoundedRect(plate, 5, 5);
        painter_.setPen(text_);
        painter_.drawText(plate.adjusted(8, 4, -8, -4), Qt::AlignLeft | Qt::TextWordWrap, text);
    }

    void captions(const std::vector<OverlayContent::Caption>& captions) {
        for (std::size_t i = 0; i < captions.size(); ++i) {
            const auto& [title, detail, tile] = captions[i];
            if (i > 0) {
                QColor line = text_;
                line.setAlphaF(0.25f);
                painter_.setPen(QPen(line, 1));
                const double x = std::round(tile.left()) + 0.5;
                painter_.drawLine(QPointF(x, tile.top()), QPointF(x, tile.bottom()));
            }
            label(QPointF(tile.center().x(), area_.top() + kMargin),
                  detail.isEmpty() ? title : title + "\n" + wrapped(detail, tile.width() - 2 * kMargin - 16),
                  Qt::AlignHCenter);
        }
    }

    /// At the bottom, between the axes and the legend's plate; else above that, in one line or one a sentence, or not
    /// at all where it does not fit.
    void hint(QString text, double strength, const QRectF& legend) {
        const QFontMetricsF metrics(painter_.font());
        const auto width = [&] {
            double most = 0;
            for (const QString& line : text.split('\n')) most = std::max(most, metrics.horizontalAdvance(line));
            return most + 16;
        };
        const double left = area_.left() + kMargin + kTriad, right = legend.isNull() ? area_.right() : legend.left();
        const bool is_beside = width() <= 2 * std::min(area_.center().x() - left, right - 6 - area_.center().x());
        if (!is_beside && width() > area_.width() - 2 * kMargin) text.replace(". ", ".\n");
        if (!is_beside && width() > area_.width() - 2 * kMargin) return;
        const double above = legend.isNull() ? area_.bottom() - kMargin - kTriad : legend.top() - 6;
        const double bottom = is_beside ? area_.bottom() - kMargin : std::min(above, area_.bottom() - kMargin - kTriad);
        label(QPointF(area_.center().x(), bottom), text, Qt::AlignHCenter | Qt::AlignBottom, strength);
    }

    /// Returns the plate.
    QRectF legend(const OverlayContent::Legend& legend) {
        constexpr double kWidth = 200, kHeight = 10;
        const QFontMetricsF metrics(painter_.font());
        QStringList title = {legend.unit.isEmpty() ? legend.title : legend.title + ", " + legend.unit};
        if (metrics.horizontalAdvance(title[0]) + 32 > area_.width() - 2 * kMargin) title = {legend.title, legend.unit};
        double width = kWidth;
        for (const QString& line : title) width = std::max(width, metrics.horizontalAdvance(line));
        width += 32;
        const double title_height = double(title.size()) * metrics.height();
        const double height = title_height + metrics.height() + kHeight + 22;
        const double left = std::round(area_.right() - kMargin - width);
        const double over_axes =
            left < area_.left() + kMargin + kTriad ? kTriad : 0; // there is no room for both side by side
        const QRectF plate(left, std::round(area_.bottom() - kMargin - over_axes - height), width, height);
        painter_.setPen(Qt::NoPen);
        painter_.setBrush(plate_);
        painter_.drawRoundedRect(plate, 5, 5);
        painter_.setPen(text_);
        painter_.drawText(plate.adjusted(16, 6, -16, 0), Qt::AlignLeft | Qt::AlignTop, title.join('\n'));

        const QRectF bar(plate.left() + 16, plate.top() + 10 + title_height, plate.width() - 32, kHeight);
        QLinearGradient gradient(bar.topLeft(), bar.topRight());
        for (int i = 0; i <= 16; ++i) {
            const Vec3f c = color_at(legend.map, static_cast<float>(i) / 16);
            gradient.setColorAt(i / 16.0, QColor::fromRgbF(c.x(), c.y(), c.z()));
        }
        painter_.setPen(Qt::NoPen);
        painter_.setBrush(gradient);
        painter_.drawRect(bar);
        painter_.setPen(text_);
        const double least = legend.range.least, most = legend.range.most;
        for (const auto& [value, text] : ticks(legend)) {
            const double x = bar.left() + bar.width() * (value - least) / std::max(most - least, 1e-30);
            painter_.drawLine(QPointF(x, bar.bottom()), QPointF(x, bar.bottom() + 3));
            const double half = metrics.horizontalAdvance(text) / 2;
            const double middle = std::clamp(x, plate.left() + 5 + half, plate.right() - 5 - half);
            painter_.drawText(QRectF(middle - half - 2, bar.bottom() + 4, 2 * half + 4, metrics.height()),
                              Qt::AlignCenter, text);
        }
        return plate;
    }

    void triad(const OverlayContent& content) {
        constexpr double kLength = 26;
        const QPointF middle(area_.left() + kMargin + 32, area_.bottom() - kMargin - 32);
        std::array<int, 3> order = {0, 1, 2};
        std::sort(order.begin(), order.end(), [&](int a, int b) {
            return content.triad_depth[std::size_t(a)] < content.triad_depth[std::size_t(b)];
        });
        for (const int i : order) {
            const auto k = static_cast<std::size_t>(i);
            const QPointF end = middle + kLength * content.triad[k];
            painter_.setPen(QPen(kAxes[k], 2.2, Qt::SolidLine, Qt::RoundCap));
            painter_.drawLine(middle, end);
            painter_.setPen(text_);
            const QPointF at = middle + (kLength + 9) * content.triad[k];
            painter_.drawText(QRectF(at.x() - 10, at.y() - 10, 20, 20), Qt::AlignCenter, QString("xyz").mid(i, 1));
        }
    }

    void pins(const std::vector<QPointF>& pins) {
        painter_.setPen(QPen(QColor(255, 255, 255, 200), 1));
        painter_.setBrush(kPin);
        for (const QPointF& pin : pins) painter_.drawEllipse(pin, 3.5, 3.5);
    }

    void hover(const QPointF& at, double radius) {
        for (const auto& [color, width] :
             {std::pair(QColor(0, 0, 0, 70), 3.0), std::pair(QColor(255, 255, 255), 1.4)}) {
            painter_.setPen(QPen(color, width));
            painter_.setBrush(Qt::NoBrush);
            painter_.drawEllipse(at, radius, radius);
        }
        painter_.setPen(Qt::NoPen);
        painter_.setBrush(Qt::white);
        painter_.drawEllipse(at, 2, 2);
    }

    void pull(const QLineF& line) {
        for (const auto& [color, width] :
             {std::pair(QColor(0, 0, 0, 90), 4.0), std::pair(QColor(255, 255, 255), 1.8)}) {
            painter_.setPen(QPen(color, width, Qt::SolidLine, Qt::RoundCap));
            painter_.drawLine(line);
        }
        painter_.setPen(QPen(QColor(0, 0, 0, 110), 1));
        painter_.setBrush(Qt::white);
        painter_.drawEllipse(line.p1(), 4, 4);
        painter_.drawEllipse(line.p2(), 3, 3);
    }

    void knob(const OverlayContent::Knob& knob) {
        const QColor color = kGizmos.at(std::size_t(knob.part));
        const double width = knob.is_hot ? 3 : 2;
        const QColor halo = is_dark_ ? QColor(0, 0, 0, 120) : QColor(255, 255, 255, 170);
        painter_.setBrush(Qt::NoBrush);
        painter_.setPen(QPen(halo, width + 2.5, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
        painter_.drawPolyline(knob.line);
        painter_.setPen(QPen(color, width, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
        painter_.drawPolyline(knob.line);
        painter_.setPen(QPen(halo, 1.2));
        painter_.setBrush(color);
        const double radius = knob.is_hot ? 6.5 : 5;
        const QPointF along = knob.line.back() - knob.line.front();
        const double length = std::hypot(along.x(), along.y());
        if (knob.has_tip && length > 3) {
            const QPointF to = along / length, side(-to.y(), to.x());
            painter_.drawPolygon(QPolygonF{knob.at + 1.5 * radius * to, knob.at - 0.5 * radius * to + radius * side,
                                           knob.at - 0.5 * radius * to - radius * side});
        } else {
            painter_.drawEllipse(knob.at, radius, radius);
        }
        if (!knob.label.isEmpty()) label(knob.at + QPointF(14, -12), knob.label, Qt::AlignLeft);
    }

    void defects(const std::vector<OverlayContent::Edge>& edges) {
        for (const OverlayContent::Edge& edge : edges) {
            painter_.setPen(QPen(QColor(255, 255, 255, 150), 4, Qt::SolidLine, Qt::RoundCap));
            painter_.drawLine(edge.line);
        }
        for (const OverlayContent::Edge& edge : edges) {
            if (edge.line.isNull()) {
                painter_.setPen(QPen(QColor(255, 255, 255, 150), 1));
                painter_.setBrush(kFlat);
                painter_.drawEllipse(edge.line.p1(), 2.5, 2.5);
                continue;
            }
            const QColor color = edge.is_open ? kOpen : edge.is_opposed ? kOpposed : kNonManifold;
            painter_.setPen(QPen(color, 2.4, Qt::SolidLine, Qt::RoundCap));
            painter_.drawLine(edge.line);
        }
    }

private:
    QString wrapped(const QString& text, double width) const {
        const QFontMetricsF metrics(painter_.font());
        QString lines, line;
        for (const QString& word : text.split(' ')) {
            if (!line.isEmpty() && metrics.horizontalAdvance(line + ' ' + word) > width) {
                lines += line + '\n';
                line = word;
            } else {
                line += line.isEmpty() ? word : ' ' + word;
            }
        }
        return lines + line;
    }
    static std::vector<std::pair<double, QString>> ticks(const OverlayContent::Legend& legend) {
        std::vector<std::pair<double, QString>> result;
        ValueRange written = legend.range;
        written.least *= static_cast<float>(legend.per_value);
        written.most *= static_cast<float>(legend.per_value);
        for (const double tick : legend_ticks(written, legend.whole ? 9 : 6)) {
            if (legend.whole && tick != std::round(tick)) continue;
            result.emplace_back(tick / legend.per_value, QString::number(tick, 'g', 3));
        }
        return result;
    }

    QPainter& painter_;
    QRectF area_;
    bool is_dark_;
    QColor text_, plate_;
};

} // namespace

Overlay::Overlay(QWidget* parent) : QWidget(parent) {
    setAttribute(Qt::WA_TransparentForMouseEvents);
    setAttribute(Qt::WA_NoSystemBackground);
    setObjectName("viewport.overlay");
}

void Overlay::set(OverlayContent content) {
    // Painting it all takes longer than many a picture beneath.
    if (content == content_) return;
    content_ = std::move(content);
    update();
}

void Overlay::set_covered(int height) {
    covered_ = height;
    update();
}

void Overlay::paintEvent(QPaintEvent*) {
    QPainter painter(this);
    Sheet sheet(painter, palette(), rect().adjusted(0, covered_, 0, 0));
    const OverlayContent& c = content_;
    if (!c.trouble.empty()) {
        painter.fillRect(rect(), palette().window());
        sheet.trouble(QString::fromStdString(c.trouble));
        return;
    }
    sheet.defects(c.defects);
    sheet.pins(c.pins);
    for (const OverlayContent::Knob& knob : c.knobs) sheet.knob(knob);
    if (c.pull) sheet.pull(*c.pull);
    if (c.hover) sheet.hover(*c.hover, c.hover_radius);
    sheet.captions(c.captions);
    double top = covered_ + (c.captions.empty() ? kMargin : kMargin + 52); // below the captions
    for (const QString& text : {c.note, c.defect_summary})
        if (!text.isEmpty()) top = sheet.label(QPointF(kMargin, top), text, Qt::AlignLeft).bottom() + 6;
    if (c.shows_triad) sheet.triad(c);
    const QRectF legend = c.legend ? sheet.legend(*c.legend) : QRectF();
    if (!c.warning.isEmpty())
        sheet.warning(c.warning, legend);
    else if (c.hint_strength > 0 && !c.hint.isEmpty())
        sheet.hint(c.hint, c.hint_strength, legend);
}

} // namespace filigree::studio
