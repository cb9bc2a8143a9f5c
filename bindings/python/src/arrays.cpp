#include "arrays.h"

#include <cmath>
#include <cstring>

namespace filigree::python {

namespace {

constexpr py::ssize_t kFloat = sizeof(float);

std::string shape_text(const py::array& array) {
    std::string text = "(";
    for (py::ssize_t k = 0; k < array.ndim(); ++k) text += (k ? ", " : "") + std::to_string(array.shape(k));
    return text + (array.ndim() == 1 ? ",)" : ")");
}

/// What a masked array hides would count as any other number.
void refuse_masked(const py::handle& given, const char* name) {
    if (!py::isinstance<py::array>(given) || !py::hasattr(given, "mask")) return;
    if (py::module_::import("numpy").attr("any")(given.attr("mask")).cast<bool>())
        refuse(std::string(name) + " has masked entries; fill them, or leave them out.");
}

/// Any array of numbers; `kinds`: those of numpy that will do.
py::array array_of_kind(const py::handle& given, const char* name, const char* kinds, const char* wanted) {
    refuse_masked(given, name);
    const py::array array = py::array::ensure(given);
    if (!array || (array.size() > 0 && !std::strchr(kinds, array.dtype().kind())))
        refuse(std::string(name) + " has to be an array of " + wanted + ".");
    return array;
}

template <class Number>
Numbers<Number> numbers_of(const py::handle& given, const char* name) {
    if (py::isinstance<Numbers<Number>>(given)) {
        refuse_masked(given, name);
        return py::reinterpret_borrow<Numbers<Number>>(given);
    }
    const auto numbers = Numbers<Number>::ensure(array_of_kind(given, name, "fiu", "numbers"));
    if (!numbers) refuse(std::string(name) + " has to be an array of numbers."); // ensure() drops Python's error
    return numbers;
}

template <class Number>
void check_finite(const Number* numbers, std::size_t count, std::size_t of_one, const char* name) {
    for (std::size_t i = 0; i < count; ++i)
        if (!std::isfinite(numbers[i]))
            refuse(std::string(name) + "[" + std::to_string(i / of_one) + "] is not finite" +
                   (sizeof(Number) == sizeof(float) ? " as a 32-bit number." : "."));
}

template <class Point, class Number>
std::vector<Point> read_points(const Numbers<Number>& numbers, const char* name) {
    const bool is_flat = numbers.ndim() == 1 && numbers.size() % 3 == 0;
    if (!is_flat && (numbers.ndim() != 2 || numbers.shape(1) != 3))
        refuse(std::string(name) + " has the shape " + shape_text(numbers) + "; points have (n, 3).");
    const auto count = static_cast<std::size_t>(numbers.size());
    check_finite(numbers.data(), count, 3, name);
    std::vector<Point> points(count / 3);
    if (count > 0) std::memcpy(static_cast<void*>(points.data()), numbers.data(), count * sizeof(Number));
    return points;
}

template <class Number>
std::vector<Number> read_values(const Numbers<Number>& numbers, const char* name) {
    if (numbers.ndim() != 1)
        refuse(std::string(name) + " has the shape " + shape_text(numbers) + "; one number each is wanted, (n,).");
    check_finite(numbers.data(), static_cast<std::size_t>(numbers.size()), 1, name);
    return std::vector<Number>(numbers.data(), numbers.data() + numbers.size());
}

} // namespace

Numbers<float> floats_of(const py::handle& given, const char* name) { return numbers_of<float>(given, name); }
Numbers<double> doubles_of(const py::handle& given, const char* name) { return numbers_of<double>(given, name); }
Numbers<long long> integers_of(const py::handle& given, const char* name) {
    const py::array array = array_of_kind(given, name, "iuf", "whole numbers");
    // What other programs write as floats (igl, savetxt) has to be whole, and no larger than doubles tell apart.
    if (array.size() > 0 && array.dtype().kind() == 'f') {
        const Numbers<double> numbers = doubles_of(array, name);
        for (py::ssize_t i = 0; i < numbers.size(); ++i)
            if (!(std::abs(numbers.data()[i]) <= 0x1p53) || std::round(numbers.data()[i]) != numbers.data()[i])
                refuse(std::string(name) + " has to be an array of whole numbers.");
    }
    const auto numbers = Numbers<long long>::ensure(array);
    if (!numbers) refuse(std::string(name) + " has to be an array of whole numbers.");
    return numbers;
}

std::vector<Vec3f> points_of(const py::handle& given, const char* name) {
    return read_points<Vec3f>(floats_of(given, name), name);
}
std::vector<Vec3d> double_points_of(const py::handle& given, const char* name) {
    return read_points<Vec3d>(doubles_of(given, name), name);
}
std::vector<float> values_of(const py::handle& given, const char* name) {
    return read_values(floats_of(given, name), name);
}
std::vector<double> double_values_of(const py::handle& given, const char* name) {
    return read_values(doubles_of(given, name), name);
}

std::vector<Mat3f> gradients_of(const py::handle& given, const char* name) {
    refuse_masked(given, name);
    // Our own gradients come back in our own order, and then nothing is turned.
    const auto numbers = py::isinstance<py::array_t<float>>(given) ? py::reinterpret_borrow<py::array_t<float>>(given)
                                                                   : py::array_t<float>(floats_of(given, name));
    if (numbers.size() == 0) return {};
    if (numbers.ndim() != 3 || numbers.shape(1) != 3 || numbers.shape(2) != 3)
        refuse(std::string(name) + " has the shape " + shape_text(numbers) + "; gradients have (n, 3, 3).");
    std::vector<Mat3f> gradients(static_cast<std::size_t>(numbers.shape(0)));
    if (numbers.strides(0) == 9 * kFloat && numbers.strides(1) == kFloat && numbers.strides(2) == 3 * kFloat) {
        std::memcpy(static_cast<void*>(gradients.data()), numbers.data(), gradients.size() * sizeof(Mat3f));
    } else {
        const auto at = numbers.unchecked<3>();
        for (std::size_t i = 0; i < gradients.size(); ++i)
            for (int row = 0; row < 3; ++row)
                for (int column = 0; column < 3; ++column)
                    gradients[i](row, column) = at(static_cast<py::ssize_t>(i), row, column);
    }
    check_finite(gradients.front().data(), 9 * gradients.size(), 9, name);
    return gradients;
}

std::vector<Index> indices_of(const py::handle& given, const char* name, std::size_t count) {
    const Numbers<long long> numbers = integers_of(given, name);
    if (numbers.ndim() != 1 && numbers.size() > 0)
        refuse(std::string(name) + " has the shape " + shape_text(numbers) + "; ids have (n,).");
    std::vector<Index> indices(static_cast<std::size_t>(numbers.size()));
    for (std::size_t i = 0; i < indices.size(); ++i) {
        const long long index = numbers.data()[i];
        if (index < 0 || index >= static_cast<long long>(count))
            refuse(std::string(name) + "[" + std::to_string(i) + "] is " + std::to_string(index) + "; there are " +
                   std::to_string(count) + ", counted from 0.");
        indices[i] = static_cast<Index>(index);
    }
    return indices;
}

Vec3d vector_of(const py::handle& given, const char* name) {
    const Numbers<double> numbers = doubles_of(given, name);
    if (numbers.size() != 3) refuse(std::string(name) + " has to be three numbers.");
    check_finite(numbers.data(), 3, 1, name);
    return {numbers.data()[0], numbers.data()[1], numbers.data()[2]};
}
std::optional<Vec3d> optional_vector_of(const py::handle& given, const char* name) {
    return given.is_none() ? std::nullopt : std::optional(vector_of(given, name));
}

Vectors vectors_of(const py::handle& given, const char* name) {
    const std::vector<Vec3f> points = points_of(given, name);
    Vectors vectors(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) vectors.set(i, points[i]);
    return vectors;
}

std::span<Vec3f> writable_points(const py::handle& out, const char* name, std::size_t count) {
    const std::string wanted = std::string(name) + " has to be a float32 array in C order, such as numpy.empty((" +
                               std::to_string(count) + ", 3), numpy.float32)";
    if (!py::isinstance<py::array_t<float>>(out)) refuse(wanted + ".");
    const auto array = py::reinterpret_borrow<py::array>(out);
    if (!(array.flags() & py::array::c_style)) refuse(wanted + "; this one has gaps or another order.");
    if (!array.writeable()) refuse(wanted + "; this one is read-only.");
    const auto rows = static_cast<py::ssize_t>(count);
    const bool is_flat = array.ndim() == 1 && array.shape(0) == 3 * rows;
    if (!is_flat && (array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != 3))
        refuse(wanted + "; this one has the shape " + shape_text(array) + ".");
    if (reinterpret_cast<std::uintptr_t>(array.data()) % alignof(float) != 0)
        refuse(wanted + "; this one is not aligned.");
    return {static_cast<Vec3f*>(const_cast<void*>(array.data())), count};
}

py::array_t<float> take(std::vector<Vec3f>&& points) {
    const auto count = static_cast<py::ssize_t>(points.size());
    return take<float>(std::move(points), Shape{count, 3});
}
py::array_t<double> take(std::vector<Vec3d>&& points) {
    const auto count = static_cast<py::ssize_t>(points.size());
    return take<double>(std::move(points), Shape{count, 3});
}
py::array_t<float> take(std::vector<Mat3f>&& gradients) {
    const auto count = static_cast<py::ssize_t>(gradients.size());
    return take<float>(std::move(gradients), Shape{count, 3, 3}, Shape{9 * kFloat, kFloat, 3 * kFloat});
}
py::array_t<float> array_of(const Vectors& vectors) {
    std::vector<Vec3f> points(vectors.size());
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = vectors[i];
    return take(std::move(points));
}
py::array_t<double> array_of(const Vec3d& vector) {
    return take(std::vector<double>{vector.x(), vector.y(), vector.z()});
}

py::array view(const std::vector<Vec3f>& points, const py::handle& owner) {
    return view(reinterpret_cast<const float*>(points.data()), Shape{static_cast<py::ssize_t>(points.size()), 3},
                owner);
}
py::array view(const std::vector<Mat3f>& gradients, const py::handle& owner) {
    return view(reinterpret_cast<const float*>(gradients.data()),
                Shape{static_cast<py::ssize_t>(gradients.size()), 3, 3}, owner, Shape{9 * kFloat, kFloat, 3 * kFloat});
}

} // namespace filigree::python
