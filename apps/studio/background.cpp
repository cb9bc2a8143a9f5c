#include "background.h"

#include "bell.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

namespace filigree::studio {

struct Background::Task {
    std::string topic;
    Work work;
    Otherwise otherwise;
};

namespace {

struct Done {
    std::string topic;
    Background::Delivery delivery;
};

} // namespace

struct Background::Content {
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::deque<Task> waiting;
    std::deque<Done> done;
    std::string running; ///< its topic; "" when nothing runs
    RunContext context;  ///< of what runs
    bool is_dropped = false, ends = false;
    Bell bell;
    std::thread thread;

    /// Under the lock.
    void drop(const std::string& topic) {
        std::erase_if(waiting, [&](const Task& task) { return task.topic == topic; });
        std::erase_if(done, [&](const Done& result) { return result.topic == topic; });
        if (running == topic) drop_running();
    }
    void drop_running() {
        is_dropped = true;
        context.cancel();
    }
};

Background::Background(QObject* parent) : QObject(parent), content_(std::make_unique<Content>()) {
    connect(&content_->bell, &Bell::rung, this, &Background::deliver);
    content_->thread = std::thread([this] {
        Content& c = *content_;
        std::unique_lock lock(c.mutex);
        for (;;) {
            c.changed.wait(lock, [&] { return c.ends || !c.waiting.empty(); });
            if (c.ends) return;
            Task task = std::move(c.waiting.front());
            c.waiting.pop_front();
            c.running = task.topic;
            c.is_dropped = false;
            c.context = RunContext();
            const RunContext context = c.context;
            lock.unlock();
            Delivery delivery = run(task, context);
            task = {}; // what it held may be large
            lock.lock();
            if (delivery && !c.is_dropped) c.done.push_back({std::exchange(c.running, {}), std::move(delivery)});
            c.running.clear();
            c.changed.notify_all();
            c.bell.ring();
        }
    });
}

/// In the other thread.
Background::Delivery Background::run(const Task& task, const RunContext& context) {
    Error error{ErrorCode::out_of_memory, "There is not enough memory for the picture; a coarser level needs less."};
    try {
        return task.work(context);
    } catch (const std::bad_alloc&) {
    } catch (const std::exception& thrown) {
        error = {ErrorCode::unsuitable, std::string("The picture was stopped by an error of our own (") +
                                            thrown.what() + "); please report it."};
    }
    return [this, error, otherwise = task.otherwise] {
        if (otherwise)
            otherwise(error);
        else
            Q_EMIT failed(error);
    };
}

Background::~Background() {
    cancel_all();
    {
        const std::lock_guard lock(content_->mutex);
        content_->ends = true;
        content_->changed.notify_all();
    }
    content_->thread.join();
}

void Background::start(const std::string& topic, Work work, bool urgent, Otherwise otherwise) {
    const std::lock_guard lock(content_->mutex);
    content_->drop(topic);
    if (urgent)
        content_->waiting.push_front({topic, std::move(work), std::move(otherwise)});
    else
        content_->waiting.push_back({topic, std::move(work), std::move(otherwise)});
    content_->changed.notify_all();
}

void Background::cancel_all() {
    const std::lock_guard lock(content_->mutex);
    content_->waiting.clear();
    content_->done.clear();
    if (!content_->running.empty()) content_->drop_running();
}

bool Background::is_busy() const {
    const std::lock_guard lock(content_->mutex);
    return !content_->waiting.empty() || !content_->done.empty() || !content_->running.empty();
}

bool Background::is_busy(const std::string& topic) const {
    const std::lock_guard lock(content_->mutex);
    const auto is_it = [&](const auto& entry) { return entry.topic == topic; };
    return std::any_of(content_->waiting.begin(), content_->waiting.end(), is_it) ||
           std::any_of(content_->done.begin(), content_->done.end(), is_it) ||
           (content_->running == topic && !content_->is_dropped);
}

void Background::wait() {
    Content& c = *content_;
    for (;;) {
        deliver();
        std::unique_lock lock(c.mutex);
        c.changed.wait(lock, [&] { return (c.waiting.empty() && c.running.empty()) || !c.done.empty(); });
        if (c.done.empty()) return;
    }
}

void Background::deliver() {
    for (;;) {
        Done result;
        {
            const std::lock_guard lock(content_->mutex);
            if (content_->done.empty()) return;
            result = std::move(content_->done.front());
            content_->done.pop_front();
        }
        result.delivery();
    }
}

} // namespace filigree::studio
