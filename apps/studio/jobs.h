// Work off the main thread: one at a time, with progress and cancel.
#pragma once

#include "filigree/context.h"
#include "filigree/result.h"

#include <QObject>
#include <QString>

#include <functional>
#include <memory>

namespace filigree::studio {

/// Runs `work` and makes what it throws an error: too little memory, with what to do about it, or a defect of ours.
Status run_guarded(const std::string& title, const std::string& advice, const std::function<Status()>& work);

struct JobOptions {
    bool is_urgent = false;                        ///< before all that waits
    std::function<void(const Error&)> failed = {}; ///< is told of an error in place of Jobs::failed()
};

/// Lives in the main thread. Work runs in a thread of its own, in the order it was started.
class Jobs : public QObject {
    Q_OBJECT
public:
    /// advice: what a user can do when memory runs out; a sentence, or "".
    explicit Jobs(std::string advice = {}, QObject* parent = nullptr);
    ~Jobs() override; ///< cancels what runs and waits for it; nothing is delivered any more

    /// `work` runs in the other thread; `done` gets its value in the main thread. Work that is started under the same
    /// `topic` as one that runs or waits takes its place: the older one is cancelled and never delivered (a slider
    /// that strips again and again). An empty topic replaces nothing. An error other than cancelled is told by
    /// failed().
    template <class T>
    void start(const QString& title, const std::string& topic, std::function<Result<T>(const RunContext&)> work,
               std::function<void(T)> done, JobOptions options = {}) {
        auto value = std::make_shared<std::optional<T>>();
        add({title, topic,
             [work = std::move(work), value](const RunContext& context) -> Status {
                 Result<T> result = work(context);
                 if (!result) return result.error();
                 value->emplace(std::move(result).value());
                 return Success{};
             },
             [done = std::move(done), value] { done(std::move(**value)); }, std::move(options)});
    }

    bool is_busy() const;                            ///< something runs or waits
    QString title() const;                           ///< of what runs; "" when nothing does
    QString phase() const;                           ///< what it is at, in the library's words
    double fraction() const;                         ///< done of that phase, 0 to 1
    void cancel();                                   ///< what runs, and all that waits
    bool is_pending(const std::string& topic) const; ///< such work runs or waits, neither cancelled nor dropped
    void drop(const std::string& topic); ///< work that nobody needs any more: cancelled, and nothing is told of it
    void drop_all();
    /// Returns when nothing runs or waits any more; deliveries happen inside. For tests, scripts and closing.
    void wait_until_idle();
    /// The same, but no other events are handled meanwhile.
    void finish_all();

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
        JobOptions options;
    };
    struct Entry;
    struct Impl;
    void add(Job job);
    void listen();
    void finish(const Entry& entry);

    std::unique_ptr<Impl> impl_;
};

} // namespace filigree::studio
