// numpy in and out: any numbers come in, and what goes out is memory of the library itself.
#pragma once

#include "errors.h"

#include <filigree/physics/body.h>
#include <filigree/types.h>

#include <pybind11/numpy.h>

#include <optional>
#include <string>
#include <vector>

namespace filigree::python {

using Shape = std::vector<py::ssize_t>;

// In. `name` stands in the sentences of errors. All refuse what is no array of finite numbers of the right shape.

/// An array of numbers of any dtype, order and strides, in C order as Number.
template <class Number>
using Numbers = py::array_t<Number, py::array::c_style | py::array::forcecast>;
Numbers<float> floats_of(const py::handle& given, const char* name);
Numbers<double> doubles_of(const py::handle& given, const char* name);
/// Whole numbers of any integer dtype.
Numbers<long long> integers_of(const py::handle& given, const char* name);

/// Points of shape (n, 3), or flat.
std::vector<Vec3f> points_of(const py::handle& given, const char* name);
std::vector<Vec3d> double_points_of(const py::handle& given, const char* name);
/// Shape (n, 3, 3): [i, row, column].
std::vector<Mat3f> gradients_of(const py::handle& given, const char* name);
/// One number each, as many as there are.
std::vector<float> values_of(const py::handle& given, const char* name);
std::vector<double> double_values_of(const py::handle& given, const char* name);
/// Ids from 0 to count - 1.
std::vector<Index> indices_of(const py::handle& given, const char* name, std::size_t count);
/// Three numbers.
Vec3d vector_of(const py::handle& given, const char* name);
std::optional<Vec3d> optional_vector_of(const py::handle& given, const char* name); ///< None: unset
Vectors vectors_of(const py::handle& given, const char* name);

/// The caller's own array of n points, to be written in place: float32, C order, writable, of shape (n, 3) or flat.
std::span<Vec3f> writable_points(const py::handle& out, const char* name, std::size_t count);

// Out.

/// A vector's memory as an array that owns it.
template <class Number, class T>
py::array_t<Number> take(std::vector<T>&& values, const Shape& shape, const Shape& strides = {}) {
    auto* kept = new std::vector<T>(std::move(values));
    const py::capsule owner(kept, [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
    const auto* data = reinterpret_cast<const Number*>(kept->data());
    return strides.empty() ? py::array_t<Number>(shape, data, owner) : py::array_t<Number>(shape, strides, data, owner);
}
py::array_t<float> take(std::vector<Vec3f>&& points);
py::array_t<double> take(std::vector<Vec3d>&& points);
py::array_t<float> take(std::vector<Mat3f>&& gradients); ///< (n, 3, 3)
template <class Number>
py::array_t<Number> take(std::vector<Number>&& values) {
    const auto count = static_cast<py::ssize_t>(values.size());
    return take<Number>(std::move(values), Shape{count});
}
py::array_t<float> array_of(const Vectors& vectors);
py::array_t<double> array_of(const Vec3d& vector);

/// A named tuple of filigree/_results.py.
template <class... Fields>
py::object named_result(const char* name, Fields&&... fields) {
    return py::module_::import("filigree._results").attr(name)(std::forward<Fields>(fields)...);
}

/// A read-only look at memory that `owner` keeps.
template <class Number>
py::array view(const Number* data, const Shape& shape, const py::handle& owner, const Shape& strides = {}) {
    py::array_t<Number> array =
        strides.empty() ? py::array_t<Number>(shape, data, owner) : py::array_t<Number>(shape, strides, data, owner);
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return array;
}
py::array view(const std::vector<Vec3f>& points, const py::handle& owner);
py::array view(const std::vector<Mat3f>& gradients, const py::handle& owner);
template <class Number>
py::array view(const std::vector<Number>& values, const py::handle& owner) {
    return view(values.data(), Shape{static_cast<py::ssize_t>(values.size())}, owner);
}

} // namespace filigree::python
