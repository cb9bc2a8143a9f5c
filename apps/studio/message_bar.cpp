#include "message_bar.h"

#include "icons.h"
#include "theme.h"

#include <QAction>
#include <QBoxLayout>
#include <QEvent>
#include <QPainter>

namespace filigree::studio {
namespace {

constexpr int kInformationTime = 8000; // ms: long enough to read a path

} // namespace

MessageBar::MessageBar(QWidget* parent)
    : QFrame(parent), icon_(new QLabel(this)), text_(new Text("message.text", Tone::plain, this)),
      offer_(new QPushButton(this)), close_(new QToolButton(this)) {
    setObjectName("message");
    icon_->setObjectName("message.icon");
    text_->setWordWrap(true);
    text_->setTextInteractionFlags(Qt::TextSelectableByMouse);
    offer_->setObjectName("message.offer");
    offer_->setFocusPolicy(Qt::TabFocus);
    offer_->setAccessibleName("What the message offers");
    offer_->setToolTip("What the message offers");
    close_->setObjectName("message.close");
    close_->setIcon(icon(Icon::close));
    close_->setAutoRaise(true);
    close_->setToolTip("Closes the message");
    close_->setAccessibleName("Close the message");
    close_->setFocusPolicy(Qt::TabFocus);
    auto* row = new QHBoxLayout(this);
    row->setContentsMargins(10, 6, 6, 6);
    row->setSpacing(8);
    row->addWidget(icon_, 0, Qt::AlignTop);
    row->addWidget(text_, 1);
    row->addWidget(offer_, 0, Qt::AlignTop);
    row->addWidget(close_, 0, Qt::AlignTop);
    hide();
    parent->installEventFilter(this);
    timer_.setSingleShot(true);
    timer_.setInterval(kInformationTime);
    connect(&timer_, &QTimer::timeout, this, &QWidget::hide);
    connect(close_, &QToolButton::clicked, this, &QWidget::hide);
}

void MessageBar::show_message(const QString& sentence, bool is_error, QAction* offer) {
    disconnect(offered_);
    offer_->setVisible(offer);
    if (offer) {
        offer_->setText(offer->text().remove('&').remove(QChar(0x2026)));
        offer_->setToolTip(offer->toolTip());
        offer_->setAccessibleName(offer_->text());
        offered_ = connect(offer_, &QPushButton::clicked, this, [this, offer] {
            hide();
            offer->trigger();
        });
    }
    is_error_ = is_error;
    sentence_ = sentence;
    text_->setTextFormat(Qt::PlainText);
    setAccessibleName(sentence);
    const int side = fontMetrics().height();
    icon_->setVisible(is_error);
    icon_->setPixmap(icon(Icon::warning).pixmap(QSize(side, side), devicePixelRatioF()));
    is_error || offer ? timer_.stop() : timer_.start();
    setVisible(!sentence.isEmpty());
    raise();
    place();
    update();
}

QString MessageBar::message() const { return isHidden() ? QString() : sentence_; }

void MessageBar::place() {
    const int margin = 12,
              width = std::min(parentWidget()->width() - 2 * margin, 50 * fontMetrics().averageCharWidth() + 300);
    const QMargins margins = layout()->contentsMargins();
    show_text(width - margins.left() - margins.right() - 2 * layout()->spacing() - close_->sizeHint().width() -
              (icon_->isHidden() ? 0 : icon_->sizeHint().width()) -
              (offer_->isHidden() ? 0 : offer_->sizeHint().width() + layout()->spacing()));
    const int height = std::max(layout()->totalHeightForWidth(width), layout()->totalMinimumSize().height());
    setGeometry((parentWidget()->width() - width) / 2, margin, width, height);
    if (isVisible()) Q_EMIT covers(margin + height);
}

void MessageBar::hideEvent(QHideEvent* event) {
    QFrame::hideEvent(event);
    if (isHidden()) Q_EMIT covers(0); // not when the window alone is hidden
}

void MessageBar::show_text(int width) {
    QStringList words = sentence_.split(' ');
    for (QString& word : words) word = text_->fontMetrics().elidedText(word, Qt::ElideMiddle, width);
    const QString shown = words.join(' ');
    if (text_->text() != shown) text_->setText(shown);
    text_->setToolTip(shown == sentence_ ? QString() : sentence_);
}

bool MessageBar::eventFilter(QObject* object, QEvent* event) {
    if (event->type() == QEvent::Resize && isVisible()) place();
    return QFrame::eventFilter(object, event);
}

void MessageBar::changeEvent(QEvent* event) {
    QFrame::changeEvent(event);
    if (event->type() == QEvent::PaletteChange && is_error_)
        icon_->setPixmap(
            icon(Icon::warning).pixmap(QSize(fontMetrics().height(), fontMetrics().height()), devicePixelRatioF()));
}

void MessageBar::paintEvent(QPaintEvent*) {
    QPainter painter(this);
    painter.setRenderHint(QPainter::Antialiasing);
    QColor ground = palette().color(QPalette::Base), line = palette().color(QPalette::Mid);
    if (is_error_) {
        const QColor bad = bad_color(palette());
        const double share = is_dark(palette()) ? 0.22 : 0.1;
        const auto mixed = [&](int a, int b) { return int(a * (1 - share) + b * share); };
        ground = QColor(mixed(ground.red(), bad.red()), mixed(ground.green(), bad.green()),
                        mixed(ground.blue(), bad.blue()));
        line = bad;
    }
    painter.setPen(line);
    painter.setBrush(ground);
    painter.drawRoundedRect(QRectF(rect()).adjusted(0.5, 0.5, -0.5, -0.5), 5, 5);
}

} // namespace filigree::studio
