// From any thread to the main thread: "look, there is something new".
#pragma once

#include <QObject>
#include <QSocketNotifier>

namespace filigree::studio {

/// Lives in the main thread. Rings that come faster than the main thread listens become one. What there is to be seen
/// is handed over by the owner, under a lock of its own.
class Bell : public QObject {
    Q_OBJECT
public:
    explicit Bell(QObject* parent = nullptr);
    ~Bell() override;

    void ring() const; ///< from any thread

Q_SIGNALS:
    void rung(); ///< in the main thread

private:
    int descriptor_;
    QSocketNotifier notifier_;
};

} // namespace filigree::studio
