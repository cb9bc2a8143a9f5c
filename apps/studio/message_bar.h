// A sentence over the top of the viewport: what went wrong, or what was done.
#pragma once

#include "controls.h"

#include <QFrame>
#include <QTimer>

namespace filigree::studio {

/// Lies over its parent, at the top. Errors, and what offers a button, stay until they are closed; information goes by
/// itself.
class MessageBar : public QFrame {
    Q_OBJECT
public:
    explicit MessageBar(QWidget* parent);

    /// offer: a button beside the sentence does it; null: none.
    void show_message(const QString& sentence, bool is_error, QAction* offer = nullptr);
    QString message() const; ///< "" when it is hidden

Q_SIGNALS:
    void covers(int height); ///< so much of the parent's top, pixels; 0: none, it is hidden

protected:
    void hideEvent(QHideEvent* event) override;
    bool eventFilter(QObject* object, QEvent* event) override;
    void paintEvent(QPaintEvent* event) override;
    void changeEvent(QEvent* event) override;

private:
    void place();
    void show_text(int width); ///< words that are wider than the line are shortened in the middle

    QLabel* icon_;
    Text* text_;
    QPushButton* offer_;
    QMetaObject::Connection offered_;
    QToolButton* close_;
    QTimer timer_;
    QString sentence_;
    bool is_error_ = false;
};

} // namespace filigree::studio
