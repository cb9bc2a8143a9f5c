// A thing that is drawn: the key that it was made of, the key that is wanted, and how one becomes the other.
#pragma once

#include "jobs.h"

#include <optional>
#include <utility>

namespace filigree::studio {

/// Where things that are drawn are made.
struct Workshop {
    /// Runs its argument with OpenGL current, or not at all.
    using WithOpenGl = std::function<void(std::function<void()>)>;

    WithOpenGl with_opengl;
    std::function<void()> changed; ///< something that was made in the background is there, or failed
    Jobs background{"A coarser level needs less."};
};

/// A number that no pose, colour or thing drawn had before; above 0.
inline std::uint64_t next_stamp() {
    static std::uint64_t last = 0; // of the main thread
    return ++last;
}

/// A value, and what it is made of. Key{} is for nothing: no value then. Values are made and end with OpenGL current.
/// Lives in the main thread, no longer than its workshop.
template <class Key, class Value>
class Shown {
public:
    Shown() = default; ///< of a value that needs no OpenGL and is made at once
    /// topic: of the work in the background; each of a workshop has its own.
    explicit Shown(Workshop& shop, std::string topic = {}) : shop_(&shop), topic_(std::move(topic)) {}

    explicit operator bool() const { return value_.has_value(); }
    Value* get() { return value_ ? &*value_ : nullptr; }
    const Value* get() const { return value_ ? &*value_ : nullptr; }
    Value* operator->() { return &*value_; }
    const Value* operator->() const { return &*value_; }
    const Key& made_of() const { return made_; }
    std::uint64_t stamp() const { return stamp_; }                 ///< another one with each value; 0: there is none
    const std::optional<Error>& problem() const { return error_; } ///< why there is none of the key wanted

    /// Whether something is to be made: the value is of another key, did not fail, and is not on its way (or was
    /// dropped on its way, with others of the workshop's).
    bool wants(const Key& key) const {
        if (!(key == wanted_)) return true;
        return !(key == Key{}) && !value_of(key) && !error_ && !(shop_ && shop_->background.is_pending(topic_));
    }

    /// Makes what is wanted of the key, at once: make(the value before, if any) returns a Result<Value>. False: that
    /// is there already.
    template <class Make>
    bool update(const Key& key, Make&& make) {
        if (!wants(key)) return false;
        with_opengl([&] {
            std::optional<Value> before = std::exchange(value_, std::nullopt);
            stamp_ = 0;
            made_ = Key{};
            want(key);
            if (!(key == Key{})) put(make(std::move(before)));
        });
        return true;
    }

    /// The same in the background: plan() returns the work, a function from RunContext to Result<Data>; upload(Data)
    /// makes a Result<Value> of it, here. keeps: the value before stays until then.
    template <class Plan, class Upload>
    bool update_later(const Key& key, Plan&& plan, Upload upload, bool keeps = false) {
        if (!wants(key)) return false;
        if (!keeps || key == Key{}) drop_value();
        want(key);
        if (key == Key{}) {
            shop_->background.drop(topic_);
            return true;
        }
        auto work = plan();
        using Data = std::remove_cvref_t<decltype(work(std::declval<const RunContext&>()).value())>;
        shop_->background.start<Data>("The picture", topic_, std::move(work),
                                      [this, key, upload = std::move(upload)](Data data) {
                                          if (key == wanted_) finish([&] { put(upload(std::move(data))); });
                                      },
                                      {.failed = [this, key](const Error& error) {
                                          if (key == wanted_) finish([&] { put(error); });
                                      }});
        return true;
    }

private:
    bool value_of(const Key& key) const { return value_ && made_ == key; }
    void want(const Key& key) {
        wanted_ = key;
        error_.reset();
    }
    void put(Result<Value> made) {
        value_.reset();
        stamp_ = made ? next_stamp() : 0;
        made_ = wanted_;
        if (made)
            value_ = std::move(made).value();
        else
            error_ = made.error();
    }
    void drop_value() {
        if (value_) with_opengl([&] { value_.reset(); });
        stamp_ = 0;
        made_ = Key{};
    }
    void finish(const std::function<void()>& work) {
        with_opengl(work);
        shop_->changed();
    }
    void with_opengl(const std::function<void()>& work) { shop_ ? shop_->with_opengl(work) : work(); }

    Workshop* shop_ = nullptr;
    std::string topic_;
    Key wanted_{}, made_{};
    std::optional<Value> value_;
    std::optional<Error> error_;
    std::uint64_t stamp_ = 0;
};

} // namespace filigree::studio
