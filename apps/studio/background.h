// What the picture needs and nobody waits for: prepared in a thread of its own, the latest wish first heard.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"

#include <QObject>

#include <functional>
#include <memory>
#include <string>

namespace filigree::studio {

/// Lives in the main thread. Unlike Jobs it shows no progress, and errors are part of what work delivers. What work
/// throws (memory that is not there) becomes an error too.
class Background : public QObject {
    Q_OBJECT
public:
    /// What is left to do with the result, in the main thread.
    using Delivery = std::function<void()>;
    /// Runs in the other thread; null: nothing to deliver.
    using Work = std::function<Delivery(const RunContext&)>;
    /// Is called in the main thread with what work threw, in place of its delivery.
    using Otherwise = std::function<void(const Error&)>;

    explicit Background(QObject* parent = nullptr);
    ~Background() override; ///< cancels what runs and waits for it; nothing is delivered any more

    /// One after the other. Work of a topic that waits or runs already is replaced; a result of it that is on its way
    /// is not delivered any more. `urgent`: before all that waits. Without `otherwise`, failed() tells.
    void start(const std::string& topic, Work work, bool urgent = false, Otherwise otherwise = nullptr);
    void cancel_all();
    bool is_busy() const; ///< something waits, runs or is to be delivered
    bool is_busy(const std::string& topic) const;
    /// Returns when all is done and delivered.
    void wait();

Q_SIGNALS:
    void failed(const Error& error);

private:
    struct Task;
    struct Content;
    Delivery run(const Task& task, const RunContext& context);
    void deliver();

    std::unique_ptr<Content> content_;
};

} // namespace filigree::studio
