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
#include <vector>

namespace filigree::studio {

namespace {

constexpr std::chrono::milliseconds kBetweenReports(33);

} // namespace

struct Jobs::Content {
    /// Work on its way from start() to delivery.
    struct Entry {
        Job job;
        RunContext context;
        bool is_replaced = false;                   ///< main thread alone
        std::optional<Status> result;               ///< from the worker; under the lock
        std::string phase;                          ///< under the lock
        double fraction = 0;                        ///< under the lock
        bool has_begun = false, has_ended = false;  ///< under the lock
        std::chrono::steady_clock::time_point rung; ///< worker alone
    };

    std::deque<std::shared_ptr<Entry>> entries; ///< main thread alone: all that was not delivered yet, in order
    std::shared_ptr<Entry> told;                ///< main thread alone: whose start was told last

    std::mutex mutex;
    std::condition_variable wake;
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
            Status result = run(*entry);
            {
                const std::scoped_lock lock(mutex);
                entry->result = std::move(result);
                entry->job.work = nullptr; // what it holds goes here, not in the main thread
                entry->has_ended = true;
                entry.reset();
            }
            bell.ring();
        }
    }

    Status run(Entry& entry) {
        if (entry.context.is_cancelled()) return cancelled_error();
        try {
            return entry.job.work(entry.context);
        } catch (const std::bad_alloc&) {
            return Error{ErrorCode::out_of_memory,
                         entry.job.title.toStdString() + ": there is not enough memory for it."};
        } catch (const std::exception& error) {
            return Error{ErrorCode::unsuitable, entry.job.title.toStdString() + ": stopped by an error of our own (" +
                                                    error.what() + "); please report it."};
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

Jobs::Jobs(QObject* parent) : QObject(parent), content_(std::make_unique<Content>()) {
    connect(&content_->bell, &Bell::rung, this, &Jobs::listen);
    content_->worker = std::thread([content = content_.get()] { content->work(); });
}

Jobs::~Jobs() {
    {
        const std::scoped_lock lock(content_->mutex);
        content_->quits = true;
        content_->waiting.clear();
    }
    for (const auto& entry : content_->entries) entry->context.cancel();
    content_->wake.notify_one();
    content_->worker.join();
}

void Jobs::add(Job job) {
    if (!job.topic.empty()) drop(job.topic);
    auto entry = std::make_shared<Content::Entry>();
    entry->job = std::move(job);
    entry->context.progress = [content = content_.get(), to = entry.get()](std::string_view phase, double fraction) {
        content->report(*to, phase, fraction);
    };
    content_->entries.push_back(entry);
    {
        const std::scoped_lock lock(content_->mutex);
        content_->waiting.push_back(std::move(entry));
    }
    content_->wake.notify_one();
}

/// Tells what the worker has done since the last time.
void Jobs::listen() {
    while (!content_->entries.empty()) {
        const std::shared_ptr<Content::Entry> entry = content_->entries.front();
        bool has_begun = false, has_ended = false;
        {
            const std::scoped_lock lock(content_->mutex);
            has_begun = entry->has_begun;
            has_ended = entry->has_ended;
        }
        if (has_begun && std::exchange(content_->told, entry) != entry && !entry->is_replaced) Q_EMIT started();
        if (!has_ended) {
            if (has_begun && !entry->is_replaced) Q_EMIT progressed();
            return;
        }
        if (content_->entries.empty() || content_->entries.front() != entry) continue; // started() may wait for jobs
        content_->entries.pop_front();
        finish(*entry->result, entry->context.is_cancelled(), entry->is_replaced, entry->job);
    }
}

void Jobs::finish(const Status& result, bool is_cancelled, bool is_replaced, const Job& job) {
    if (!is_replaced) {
        if (result) // also when it was cancelled too late
            job.deliver();
        else if (is_cancelled || result.error().code == ErrorCode::cancelled)
            Q_EMIT cancelled(job.title);
        else
            Q_EMIT failed(result.error());
    }
    Q_EMIT finished();
}

bool Jobs::is_busy() const { return !content_->entries.empty(); }

QString Jobs::title() const { return is_busy() ? content_->entries.front()->job.title : QString(); }

QString Jobs::phase() const {
    if (!is_busy()) return {};
    const std::scoped_lock lock(content_->mutex);
    return QString::fromStdString(content_->entries.front()->phase);
}

double Jobs::fraction() const {
    if (!is_busy()) return 0;
    const std::scoped_lock lock(content_->mutex);
    return content_->entries.front()->fraction;
}

void Jobs::cancel() {
    for (const auto& entry : content_->entries) entry->context.cancel();
}

void Jobs::drop(const std::string& topic) {
    for (const auto& entry : content_->entries)
        if (entry->job.topic == topic) {
            entry->is_replaced = true;
            entry->context.cancel();
        }
}

bool Jobs::is_pending(const std::string& topic) const {
    return std::any_of(content_->entries.begin(), content_->entries.end(), [&](const auto& entry) {
        return entry->job.topic == topic && !entry->is_replaced && !entry->context.is_cancelled();
    });
}

void Jobs::wait_until_idle() {
    while (is_busy()) QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents);
}

} // namespace filigree::studio
