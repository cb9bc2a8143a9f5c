#include "jobs.h"

#include "bell.h"

#include <QCoreApplication>
#include <QEventLoop>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
#include <thread>

namespace filigree::studio {

namespace {

constexpr std::chrono::milliseconds kBetweenReports(33);

} // namespace

Status run_guarded(const std::string& title, const std::string& advice, const std::function<Status()>& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory,
                     title + ": there is not enough memory for it." + (advice.empty() ? "" : ' ' + advice)};
    } catch (const std::exception& error) {
        return Error{ErrorCode::unsuitable,
                     title + ": stopped by an error of our own (" + error.what() + "); please report it."};
    }
}

/// Work on its way from start() to delivery.
struct Jobs::Entry {
    Job job;
    RunContext context;
    bool is_dropped = false; ///< main thread alone
    // Under the lock:
    std::optional<Status> result; ///< from the worker
    std::string phase;
    double fraction = 0;
    bool has_begun = false, has_ended = false;

    std::chrono::steady_clock::time_point rung; ///< worker alone
};

struct Jobs::Impl {
    std::string advice;
    std::deque<std::shared_ptr<Entry>> entries; ///< main thread alone: all that was not delivered yet, in order
    std::shared_ptr<Entry> told;                ///< main thread alone: whose start was told last

    std::mutex mutex;
    std::condition_variable wake, ended;
    std::deque<std::shared_ptr<Entry>> waiting; ///< under the lock
    bool quits = false;                         ///< under the lock
    Bell bell;
    std::thread worker;

    void work() {
        for (;;) {
            std::shared_ptr<Entry> entry;
            {
                std::unique_lock lock(mutex);
                wake.wait(lock, [&] { return quits || !waiting.empty(); });
                if (quits) return;
                entry = std::move(waiting.front());
                waiting.pop_front();
                entry->has_begun = true;
            }
            bell.ring();
            Status result = cancelled_error();
            if (!entry->context.is_cancelled())
                result = run_guarded(entry->job.title.toStdString(), advice,
                                     [&] { return entry->job.work(entry->context); });
            {
                const std::scoped_lock lock(mutex);
                entry->result = std::move(result);
                entry->job.work = nullptr; // what it holds goes here, not in the main thread
                entry->has_ended = true;
                entry.reset();
            }
            ended.notify_one();
            bell.ring();
        }
    }

    void report(Entry& entry, std::string_view phase, double fraction) {
        const auto now = std::chrono::steady_clock::now();
        if (now - entry.rung < kBetweenReports) return;
        entry.rung = now;
        {
            const std::scoped_lock lock(mutex);
            entry.phase = phase;
            entry.fraction = fraction;
        }
        bell.ring();
    }
};

Jobs::Jobs(std::string advice, QObject* parent) : QObject(parent), impl_(std::make_unique<Impl>()) {
    impl_->advice = std::move(advice);
    connect(&impl_->bell, &Bell::rung, this, &Jobs::listen);
    impl_->worker = std::thread([impl = impl_.get()] { impl->work(); });
}

Jobs::~Jobs() {
    {
        const std::scoped_lock lock(impl_->mutex);
        impl_->quits = true;
        impl_->waiting.clear();
    }
    cancel();
    impl_->wake.notify_one();
    impl_->worker.join();
}

void Jobs::add(Job job) {
    if (!job.topic.empty()) drop(job.topic);
    const bool is_urgent = job.options.is_urgent;
    auto entry = std::make_shared<Entry>();
    entry->job = std::move(job);
    entry->context.progress = [impl = impl_.get(), to = entry.get()](std::string_view phase, double fraction) {
        impl->report(*to, phase, fraction);
    };
    {
        const std::scoped_lock lock(impl_->mutex);
        impl_->waiting.insert(is_urgent ? impl_->waiting.begin() : impl_->waiting.end(), entry);
        const auto first_waiting =
            std::find_if(impl_->entries.begin(), impl_->entries.end(), [](const auto& e) { return !e->has_begun; });
        impl_->entries.insert(is_urgent ? first_waiting : impl_->entries.end(), entry);
    }
    impl_->wake.notify_one();
}

/// Tells what the worker has done since the last time.
void Jobs::listen() {
    while (!impl_->entries.empty()) {
        const std::shared_ptr<Entry> entry = impl_->entries.front();
        bool has_begun = false, has_ended = false;
        {
            const std::scoped_lock lock(impl_->mutex);
            has_begun = entry->has_begun;
            has_ended = entry->has_ended;
        }
        if (has_begun && std::exchange(impl_->told, entry) != entry && !entry->is_dropped) Q_EMIT started();
        if (!has_ended) {
            if (has_begun && !entry->is_dropped) Q_EMIT progressed();
            return;
        }
        if (impl_->entries.empty() || impl_->entries.front() != entry) continue; // started() may wait for jobs
        impl_->entries.pop_front();
        finish(*entry);
    }
}

void Jobs::finish(const Entry& entry) {
    const Status& result = *entry.result;
    if (entry.is_dropped) {
        // nobody waits for it
    } else if (result) { // also when it was cancelled too late
        entry.job.deliver();
    } else if (entry.context.is_cancelled() || result.error().code == ErrorCode::cancelled) {
        Q_EMIT cancelled(entry.job.title);
    } else if (entry.job.options.failed) {
        entry.job.options.failed(result.error());
    } else {
        Q_EMIT failed(result.error());
    }
    Q_EMIT finished();
}

bool Jobs::is_busy() const { return !impl_->entries.empty(); }

QString Jobs::title() const { return is_busy() ? impl_->entries.front()->job.title : QString(); }

QString Jobs::phase() const {
    if (!is_busy()) return {};
    const std::scoped_lock lock(impl_->mutex);
    return QString::fromStdString(impl_->entries.front()->phase);
}

double Jobs::fraction() const {
    if (!is_busy()) return 0;
    const std::scoped_lock lock(impl_->mutex);
    return impl_->entries.front()->fraction;
}

void Jobs::cancel() {
    for (const auto& entry : impl_->entries) entry->context.cancel();
}

void Jobs::drop(const std::string& topic) {
    for (const auto& entry : impl_->entries)
        if (entry->job.topic == topic) {
            entry->is_dropped = true;
            entry->context.cancel();
        }
}

void Jobs::drop_all() {
    for (const auto& entry : impl_->entries) entry->is_dropped = true;
    cancel();
}

bool Jobs::is_pending(const std::string& topic) const {
    return std::ranges::any_of(impl_->entries, [&](const auto& entry) {
        return entry->job.topic == topic && !entry->is_dropped && !entry->context.is_cancelled();
    });
}

void Jobs::wait_until_idle() {
    while (is_busy()) QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents);
}

void Jobs::finish_all() {
    while (is_busy()) {
        {
            std::unique_lock lock(impl_->mutex);
            impl_->ended.wait(lock, [&] { return impl_->entries.front()->has_ended; });
        }
        listen();
    }
}

} // namespace filigree::studio
