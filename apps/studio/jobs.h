// Long work off the main thread: one at a time, with progress and cancel.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"

#include <QObject>
#include <QString>

#include <functional>
#include <memory>

namespace filigree::studio {

/// Lives in the main thread. Work runs in a thread of its own, in the order it was started.
class Jobs : public QObject {
    Q_OBJECT
public:
    explicit Jobs(QObject* parent = nullptr);
    ~Jobs() override; ///< cancels what runs and waits for it; nothing is delivered any more

    /// `work` runs in the other thread; `done` gets its value in the main thread. Work that is started under the same
    /// `topic` as one that runs or waits takes its place: the older one is cancelled and never delivered (a slider
    /// that strips again and again). An empty topic replaces nothing. An error other than cancelled is told by
    /// failed().
    template <class T>
    void start(const QString& title, const std::string& topic, std::function<Result<T>(const RunContext&)> work,
               std::function<void(T)> done) {
        auto value = std::make_shared<std::optional<T>>();
        add({title, topic,
             [work = std::move(work), value](const RunContext& context) -> Status {
                 Result<T> result = work(context);
                 if (!result) return result.error();
                 value->emplace(std::move(result).value());
                 return Success{};
             },
             [done = std::move(done), value] { done(std::move(**value)); }});
    }

    bool is_busy() const;                            ///< something runs or waits
    QString title() const;                           ///< of what runs; "" when nothing does
    QString phase() const;                           ///< what it is at, in the library's words
    double fraction() const;                         ///< done of that phase, 0 to 1
    void cancel();                                   ///< what runs, and all that waits
    bool is_pending(const std::string& topic) const; ///< such work runs or waits, neither cancelled nor dropped
    void drop(const std::string& topic); ///< work that nobody needs any more: cancelled, and nothing is told of it
    /// Returns when nothing runs or waits any more; deliveries happen inside. For tests, scripts and closing.
    void wait_until_idle();

Q_SIGNALS:
    void started();
    void progressed(); ///< at most some thirty times a second
    void finished();   ///< after delivery, cancelled or failed
    void failed(const Error& error);
    void cancelled(const QString& title);

private:
    struct Job {
        QString title;
        std::string topic;
        std::function<Status(const RunContext&)> work;
        std::function<void()> deliver;
    };
    void add(Job job);
    void listen();
    void finish(const Status& result, bool is_cancelled, bool is_replaced, const Job& job);

    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace filigree::studio
