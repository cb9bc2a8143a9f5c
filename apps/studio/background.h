// What the picture needs and nobody waits for: prepared in a thread of its own, the latest wish first heard.
#pragma once

#include "filigree/core/run_context.h"

#include <QObject>

#include <functional>
#include <memory>
#include <string>

namespace filigree::studio {

/// Lives in the main thread. Unlike Jobs it shows no progress and tells no errors: work that fails delivers nothing.
class Background : public QObject {
    Q_OBJECT
public:
    /// What is left to do with the result, in the main thread.
    using Delivery = std::function<void()>;
    /// Runs in the other thread; null: nothing to deliver.
    using Work = std::function<Delivery(const RunContext&)>;

    explicit Background(QObject* parent = nullptr);
    ~Background() override; ///< cancels what runs and waits for it; nothing is delivered any more

    /// One after the other. Work of a topic that waits or runs already is replaced; a result of it that is on its way
    /// is not delivered any more. `urgent`: before all that waits.
    void start(const std::string& topic, Work work, bool urgent = false);
    void cancel_all();
    bool is_busy() const; ///< something waits, runs or is to be delivered
    bool is_busy(const std::string& topic) const;
    /// Returns when all is done and delivered.
    void wait();

private:
    void deliver();

    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace filigree::studio
