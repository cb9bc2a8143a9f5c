#include "json.h"

#include <algorithm>
#include <variant>

#include <nlohmann/json.hpp>

namespace filigree::cli {

namespace {

using Library = nlohmann::ordered_json;

struct Object {
    std::vector<std::string> keys;
    std::vector<Json> values; ///< one a key

    std::size_t find(std::string_view key) const {
        return static_cast<std::size_t>(std::find(keys.begin(), keys.end(), key) - keys.begin());
    }
};

using Plain = std::variant<bool, std::int64_t, std::uint64_t, double, std::string, std::vector<Json>, Object>;

Json from_library(const Library& value) {
    if (value.is_object()) {
        Json object = Json::object();
        for (const auto& [key, member] : value.items()) object[key] = from_library(member);
        return object;
    }
    if (value.is_array()) {
        Json list = Json::array();
        for (const Library& entry : value) list.push_back(from_library(entry));
        return list;
    }
    if (value.is_string()) return value.get<std::string>();
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number_unsigned()) return value.get<std::uint64_t>();
    if (value.is_number_integer()) return value.get<std::int64_t>();
    if (value.is_number()) return value.get<double>();
    return {};
}

} // namespace

struct Json::Value {
    Plain plain;

    struct ToLibrary {
        Library operator()(const std::vector<Json>& list) const {
            Library result = Library::array();
            for (const Json& value : list) result.push_back(convert(value));
            return result;
        }
        Library operator()(const Object& object) const {
            Library result = Library::object();
            for (std::size_t k = 0; k < object.keys.size(); ++k) result[object.keys[k]] = convert(object.values[k]);
            return result;
        }
        template <class T>
        Library operator()(const T& value) const {
            return value;
        }
        static Library convert(const Json& json) {
            return json.value_ ? std::visit(ToLibrary(), json.value_->plain) : Library();
        }
    };
};

template <class Plain>
const Plain* Json::get_if() const {
    return value_ ? std::get_if<Plain>(&value_->plain) : nullptr;
}

Json::Json() = default;
Json::Json(Value value) : value_(std::make_unique<Value>(std::move(value))) {}
Json::Json(bool value) : Json(Value{value}) {}
Json::Json(std::int64_t value) : Json(Value{value}) {}
Json::Json(std::uint64_t value) : Json(Value{value}) {}
Json::Json(double value) : Json(Value{value}) {}
Json::Json(const char* text) : Json(Value{std::string(text)}) {}
Json::Json(std::string_view text) : Json(Value{std::string(text)}) {}
Json::Json(const std::string& text) : Json(Value{text}) {}
Json::Json(std::vector<Json> list) : Json(Value{std::move(list)}) {}
Json::Json(const Json& other) : value_(other.value_ ? std::make_unique<Value>(*other.value_) : nullptr) {}
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(Json other) noexcept {
    value_ = std::move(other.value_);
    return *this;
}
Json::~Json() = default;

Json::Json(std::initializer_list<Json> values) {
    const auto is_member = [](const Json& value) {
        const auto* pair = value.get_if<std::vector<Json>>();
        return pair && pair->size() == 2 && pair->front().get_if<std::string>();
    };
    if (!std::all_of(values.begin(), values.end(), is_member)) {
        *this = Json(std::vector<Json>(values));
        return;
    }
    *this = object();
    for (const Json& value : values) {
        const auto& pair = *value.get_if<std::vector<Json>>();
        (*this)[*pair[0].get_if<std::string>()] = pair[1];
    }
}

Json Json::array() { return std::vector<Json>(); }
Json Json::object() { return Json(Value{Object()}); }

Json& Json::operator[](std::string_view key) {
    if (!value_) *this = object();
    auto& members = std::get<Object>(value_->plain);
    const std::size_t place = members.find(key);
    if (place == members.keys.size()) {
        members.keys.emplace_back(key);
        members.values.emplace_back();
    }
    return members.values[place];
}

Json& Json::at(std::size_t place) { return std::get<std::vector<Json>>(value_->plain).at(place); }

void Json::push_back(Json value) {
    if (!value_) *this = array();
    std::get<std::vector<Json>>(value_->plain).push_back(std::move(value));
}

bool Json::is_object() const { return get_if<Object>(); }

bool Json::empty() const {
    if (const auto* list = get_if<std::vector<Json>>()) return list->empty();
    const auto* members = get_if<Object>();
    return !members || members->keys.empty();
}

const Json* Json::find(std::string_view key) const {
    const auto* members = get_if<Object>();
    if (!members) return nullptr;
    const std::size_t place = members->find(key);
    return place < members->keys.size() ? &members->values[place] : nullptr;
}

std::optional<double> Json::number() const {
    if (const auto* value = get_if<double>()) return *value;
    if (const auto* value = get_if<std::int64_t>()) return static_cast<double>(*value);
    if (const auto whole = count()) return static_cast<double>(*whole);
    return {};
}

std::optional<std::uint64_t> Json::count() const {
    const auto* value = get_if<std::uint64_t>();
    return value ? std::optional(*value) : std::nullopt;
}

std::string Json::text() const {
    return Value::ToLibrary::convert(*this).dump(2, ' ', false, Library::error_handler_t::replace);
}

std::optional<Json> Json::parse(const std::string& text) {
    const Library value = Library::parse(text, nullptr, false);
    if (value.is_discarded()) return {};
    return from_library(value);
}

} // namespace filigree::cli
