// Results and errors: how every call of the library fails.
//
// A call that may fail returns Result<T>: a value, or an Error with a code and one sentence. Check it, then take the
// value:
//
//     const Result<MeshFile> file = read_mesh("scan.ply");
//     if (!file) {
//         std::cerr << file.error().message << '\n';
//         return static_cast<int>(file.error().code);
//     }
//     const Mesh& mesh = file->mesh;
//
// value() of a failed result throws BadResultAccess, whose what() is the same sentence. The library throws nothing else
// but std::bad_alloc.
#pragma once

#include <cassert>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace filigree {

/// The kinds of failure a caller can tell apart. The command line's exit code is the number (docs/conventions.md).
enum class ErrorCode {
    usage = 2,       ///< an argument makes no sense
    not_found = 3,   ///< a file cannot be opened or read
    bad_file = 4,    ///< a file's content is damaged or not what its name says
    unsupported = 5, ///< a format or feature we do not have
    unwritable = 6,  ///< the output cannot be written
    unsuitable = 7,  ///< the input is fine, but this method cannot work on it (the message says what can)
    mismatch = 8,    ///< two inputs do not belong together (a pose of another model)
    out_of_memory = 9,
    cancelled = 130, ///< the user changed their mind
};

/// What went wrong. `message` is one sentence for a person: the place ("cow.obj:214"), the cause, what to do.
struct Error {
    ErrorCode code = ErrorCode::usage;
    std::string message;
};

/// What a failed Result throws when its value is asked for; what() is the error's sentence.
class BadResultAccess : public std::runtime_error {
public:
    explicit BadResultAccess(Error error) : std::runtime_error(error.message), error_(std::move(error)) {}
    const Error& error() const { return error_; }

private:
    Error error_;
};

/// A value or an Error.
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : content_(std::in_place_index<1>, std::move(error)) {}

    bool ok() const { return content_.index() == 0; }
    explicit operator bool() const { return ok(); }

    /// The value; a failed result throws BadResultAccess with its error. By value from a temporary, so that it cannot
    /// dangle in a loop over it.
    T& value() & {
        require_value();
        return *std::get_if<0>(&content_);
    }
    const T& value() const& {
        require_value();
        return *std::get_if<0>(&content_);
    }
    T value() && {
        require_value();
        return std::move(*std::get_if<0>(&content_));
    }
    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T operator*() && { return std::move(*this).value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }

    /// The error; only of a failed result.
    const Error& error() const {
        assert(!ok());
        return *std::get_if<1>(&content_);
    }

private:
    void require_value() const {
        if (const Error* error = std::get_if<1>(&content_)) throw BadResultAccess(*error);
    }

    std::variant<T, Error> content_;
};

/// Success without a value: `return Success{};`
struct Success {};
using Status = Result<Success>;

} // namespace filigree
