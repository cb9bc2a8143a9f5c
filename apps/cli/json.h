// What --json prints, built from plain values. json.cpp alone knows the JSON library.
#pragma once

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filigree::cli {

/// A JSON value; objects keep the order in which their keys came.
class Json {
public:
    Json(); ///< null
    Json(bool value);
    Json(std::int64_t value);
    Json(std::uint64_t value);
    template <std::integral T>
    Json(T value)
        : Json(static_cast<std::conditional_t<std::signed_integral<T>, std::int64_t, std::uint64_t>>(value)) {}
    Json(double value);
    Json(const char* text);
    Json(std::string_view text);
    Json(const std::string& text);
    Json(std::vector<Json> list);
    /// A list of anything that can be a value.
    template <class List>
    requires requires(const List& list) { list.begin() != list.end(); }
    Json(const List& list) : Json(std::vector<Json>(list.begin(), list.end())) {}
    /// {{"key", value}, ...} is an object, anything else a list.
    Json(std::initializer_list<Json> values);
    Json(const Json& other);
    Json(Json&& other) noexcept;
    Json& operator=(Json other) noexcept;
    ~Json();

    static Json array();
    static Json object();

    /// The value of a key, added where it is not there. A null becomes an object.
    Json& operator[](std::string_view key);
    /// The value at a place in a list.
    Json& at(std::size_t place);
    /// A null becomes a list.
    void push_back(Json value);

    bool is_object() const;
    /// Of a list or an object: whether nothing is in it.
    bool empty() const;
    /// The value of an object's key; null pointer: there is none.
    const Json* find(std::string_view key) const;
    std::optional<double> number() const;       ///< of any kind; unset: something else
    std::optional<std::uint64_t> count() const; ///< a whole number from 0 up; unset: something else

    /// Indented by two. What is not UTF-8 in a text is replaced.
    std::string text() const;
    /// Unset: the text is no JSON.
    static std::optional<Json> parse(const std::string& text);

private:
    struct Value;
    explicit Json(Value value);
    template <class Plain>
    const Plain* get_if() const;

    std::unique_ptr<Value> value_; ///< null: the JSON null
};

} // namespace filigree::cli
