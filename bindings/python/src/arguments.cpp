// What pybind11 leaves to its modules: wrong arguments are told in one sentence in place of a list of signatures, and
// objects that were never initialised, or are pickled by the oldest protocols, raise an exception.
#include "areas.h"

#include <pybind11/eval.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filigree::python {

namespace {

constexpr std::size_t kNone = std::string_view::npos;

struct Parameter {
    std::string name, type; ///< as pybind11 writes it: "Optional[int]"
    bool has_default = false, by_name_only = false;
};

/// A function as pybind11's message about wrong arguments says it.
struct Signature {
    std::string function;
    std::vector<Parameter> parameters;
    bool takes_any_positional = false, takes_any_named = false, has_overloads = false;
    bool makes_object = false; ///< what is given begins with the object, which is no parameter

    const Parameter* find(std::string_view name) const {
        const auto found = std::ranges::find(parameters, name, &Parameter::name);
        return found == parameters.end() ? nullptr : &*found;
    }
};

/// The end of what is not inside brackets or quotation marks, up to one of `ends`.
std::size_t end_of_part(std::string_view text, std::size_t at, std::string_view ends) {
    int depth = 0;
    char quoted = 0;
    for (; at < text.size(); ++at) {
        const char c = text[at];
        if (quoted != 0) {
            if (c == quoted) quoted = 0;
        } else if (c == '\'' || c == '"') {
            quoted = c;
        } else if (depth == 0 && ends.find(c) != kNone) {
            return at;
        } else if (std::string_view("([{").find(c) != kNone) {
            ++depth;
        } else if (std::string_view(")]}").find(c) != kNone) {
            --depth;
        }
    }
    return at;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
}

void add_parameter(std::string_view part, Signature& signature, bool& by_name_only) {
    if (part == "*" || part == "/" || part.empty()) {
        by_name_only = by_name_only || part == "*";
    } else if (part.starts_with("**")) {
        signature.takes_any_named = true;
    } else if (part.starts_with("*")) {
        signature.takes_any_positional = by_name_only = true;
    } else {
        const std::size_t colon = std::min(part.find(':'), part.size());
        const std::size_t equals = end_of_part(part, colon, "=");
        Parameter parameter{std::string(trimmed(part.substr(0, std::min(colon, equals)))), "", equals < part.size(),
                            by_name_only};
        if (colon < equals) parameter.type = trimmed(part.substr(colon + 1, equals - colon - 1));
        signature.parameters.push_back(std::move(parameter));
    }
}

/// None: the message is another one.
std::optional<Signature> signature_of(std::string_view message) {
    if (message.find("incompatible function arguments") == kNone &&
        message.find("incompatible constructor arguments") == kNone)
        return std::nullopt;
    Signature signature;
    signature.function = message.substr(0, message.find('('));
    const std::size_t first = message.find("\n    1. ");
    if (first == kNone) return std::nullopt;
    signature.has_overloads = message.find("\n    2. ") != kNone;
    const std::size_t begin = first + 8, open = message.find('(', begin);
    if (open == kNone) return std::nullopt;
    if (open > begin) { // a class and what it is made of
        signature.function = message.substr(begin, open - begin);
        signature.function.erase(0, signature.function.rfind('.') + 1);
        signature.makes_object = true;
    }
    const std::size_t close = end_of_part(message, open + 1, ")");
    bool by_name_only = false;
    for (std::size_t at = open + 1; at < close;) {
        const std::size_t end = std::min(end_of_part(message, at, ","), close);
        add_parameter(trimmed(message.substr(at, end - at)), signature, by_name_only);
        at = end + 1;
    }
    return signature;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j)
            diagonal = std::exchange(row[j + 1], std::min({row[j] + 1, row[j + 1] + 1, diagonal + (a[i] != b[j])}));
    }
    return row.back();
}

/// Words that other programs have for our parameters.
constexpr std::array<std::pair<std::string_view, std::string_view>, 20> kOtherWords = {{
    {"vertices", "base"},
    {"target", "base"},
    {"count", "base"},
    {"num_vertices", "base"},
    {"target_vertices", "base"},
    {"faces", "quads"},
    {"count", "quads"},
    {"angle", "degrees"},
    {"scale", "factor"},
    {"amount", "factor"},
    {"size", "spacing"},
    {"resolution", "spacing"},
    {"n", "count"},
    {"points", "count"},
    {"file", "path"},
    {"filename", "path"},
    {"fps", "frames_per_second"},
    {"seconds", "frames"},
    {"young", "young_modulus"},
    {"verbose", "progress"},
}};

/// The parameter that a wrong name probably means; empty: none is like it.
std::string meant_by(std::string_view name, const Signature& signature) {
    std::string best;
    std::size_t least = std::max<std::size_t>(2, name.size() / 3) + 1;
    for (const Parameter& parameter : signature.parameters) {
        const std::size_t distance = edit_distance(name, parameter.name);
        if (parameter.name == "self" || distance >= least) continue;
        least = distance;
        best = parameter.name;
    }
    for (const auto& [other, ours] : kOtherWords)
        if (best.empty() && other == name && signature.find(ours)) best = ours;
    return best;
}

std::string list_of(const Signature& signature, bool only_by_name) {
    std::string list;
    for (const Parameter& parameter : signature.parameters)
        if (parameter.name != "self" && (!only_by_name || parameter.by_name_only))
            list += (list.empty() ? "" : ", ") + parameter.name;
    return list;
}

std::string type_name(py::handle value) { return Py_TYPE(value.ptr())->tp_name; }

/// "int" of "Optional[int]", and whether None will do.
std::pair<std::string_view, bool> plain_type(std::string_view type) {
    constexpr std::string_view kOptional = "Optional[";
    if (!type.starts_with(kOptional) || !type.ends_with("]")) return {type, false};
    return {type.substr(kOptional.size(), type.size() - kOptional.size() - 1), true};
}

bool is_of_type(py::handle value, std::string_view type) {
    const bool is_float = PyFloat_Check(value.ptr()) != 0;
    if (type == "int") return !is_float && PyIndex_Check(value.ptr()) != 0;
    if (type == "float") return PyNumber_Check(value.ptr()) != 0;
    if (type == "str") return PyUnicode_Check(value.ptr()) != 0;
    constexpr std::string_view kOurs = "filigree.";
    if (!type.starts_with(kOurs)) return true; // nothing is known of it
    const py::object ours =
        py::getattr(py::module_::import("filigree._core"), std::string(type.substr(kOurs.size())).c_str(), py::none());
    return !PyType_Check(ours.ptr()) || py::isinstance(value, ours);
}

/// What is wrong with the type of one argument; empty: nothing that can be told here.
std::string wrong_type(const Parameter& parameter, py::handle value) {
    const auto [type, may_be_none] = plain_type(parameter.type);
    if ((may_be_none && value.is_none()) || is_of_type(value, type)) return "";
    return parameter.name + " has to be " + std::string(type) + (may_be_none ? " or None" : "") + ", and is of type " +
           type_name(value);
}

/// The same where a whole number is below 0, which most parameters do not take.
std::string wrong_number(const Parameter& parameter, py::handle value) {
    if (plain_type(parameter.type).first != "int" || value.is_none()) return "";
    const py::int_ number(py::reinterpret_borrow<py::object>(value));
    if (!(number < py::int_(0))) return "";
    return parameter.name + " is " + py::str(py::handle(number)).cast<std::string>() + ", and has to be 0 or more";
}

/// The sentence for arguments that no overload takes.
std::string sentence_for(const Signature& signature, const py::tuple& args, const py::dict& kwargs) {
    const std::string call = signature.function + "()";
    const std::vector<Parameter>& parameters = signature.parameters;
    std::vector<std::pair<const Parameter*, py::handle>> given;
    const auto by_position = std::size_t(std::ranges::count(parameters, false, &Parameter::by_name_only));
    for (std::size_t i = 0; i < std::min(args.size(), by_position); ++i)
        given.emplace_back(&parameters[i], PyTuple_GET_ITEM(args.ptr(), py::ssize_t(i)));
    for (const auto& [key, value] : kwargs) {
        const std::string name = py::str(key);
        const Parameter* parameter = signature.find(name);
        if (!parameter && signature.takes_any_named) continue;
        if (!parameter) {
            const std::string meant = meant_by(name, signature);
            if (!meant.empty()) return call + " has no parameter '" + name + "'; did you mean '" + meant + "'?";
            return call + " has no parameter '" + name + "'; it has " + list_of(signature, false) + ".";
        }
        if (std::ranges::find(given, parameter, [](const auto& one) { return one.first; }) != given.end())
            return call + " was given '" + name + "' twice, by position and by name.";
        given.emplace_back(parameter, value);
    }
    const std::size_t self = !parameters.empty() && parameters[0].name == "self" ? 1 : 0;
    if (args.size() > by_position && !signature.takes_any_positional && !signature.has_overloads) {
        const std::string others = list_of(signature, true);
        return call + " takes " + std::to_string(by_position - self) +
               (by_position - self == 1 ? " argument" : " arguments") + " by position and was given " +
               std::to_string(args.size() - self) + (others.empty() ? "." : "; others go by name: " + others + ".");
    }
    for (const Parameter& parameter : parameters)
        if (!parameter.has_default && !signature.has_overloads &&
            std::ranges::find(given, &parameter, [](const auto& one) { return one.first; }) == given.end())
            return call + " needs an argument '" + parameter.name + "'.";
    std::string kinds;
    for (const auto wrong_with : {&wrong_type, &wrong_number})
        for (const auto& [parameter, value] : given)
            if (parameter->name != "self" && !signature.has_overloads)
                if (const std::string wrong = wrong_with(*parameter, value); !wrong.empty())
                    return call + ": " + wrong + ".";
    for (const auto& [parameter, value] : given)
        if (parameter->name != "self")
            kinds += (kinds.empty() ? "" : ", ") + parameter->name + " is of type " + type_name(value);
    return call + " cannot take these arguments: " + kinds + ". help() says what they have to be.";
}

PyCFunctionWithKeywords dispatcher = nullptr; ///< pybind11's, of all functions

/// Puts one sentence in the place of pybind11's list.
void mend_error(PyObject* args, PyObject* kwargs) {
    py::error_scope kept; // what is set is set again at the end
    if (!kept.value) return;
    const std::string message = py::str(kept.value);
    const std::optional<Signature> signature = signature_of(message);
    if (!signature) return;
    const py::tuple positional = py::reinterpret_steal<py::tuple>(
        PyTuple_GetSlice(args, signature->makes_object ? 1 : 0, PyTuple_GET_SIZE(args)));
    const py::dict named = kwargs ? py::reinterpret_borrow<py::dict>(kwargs) : py::dict();
    const py::str sentence(sentence_for(*signature, positional, named));
    Py_XDECREF(kept.value);
    kept.value = sentence.inc_ref().ptr();
}

PyObject* call(PyObject* self, PyObject* args, PyObject* kwargs) {
    PyObject* const result = dispatcher(self, args, kwargs);
    if (result || !PyErr_ExceptionMatches(PyExc_TypeError)) return result;
    try {
        mend_error(args, kwargs);
    } catch (const std::exception&) { // pybind11's own words stay
    }
    return nullptr;
}

void mend_function(py::handle function) {
    if (PyInstanceMethod_Check(function.ptr())) function = PyInstanceMethod_GET_FUNCTION(function.ptr());
    if (!PyCFunction_Check(function.ptr())) return;
    PyMethodDef* const method = reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
    if (method->ml_flags != (METH_VARARGS | METH_KEYWORDS)) return;
    const auto own = reinterpret_cast<PyCFunctionWithKeywords>(reinterpret_cast<void (*)()>(method->ml_meth));
    if (!dispatcher) dispatcher = own;
    if (own == dispatcher) method->ml_meth = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&call));
}

/// pybind11 makes room for an object that nobody initialised when it is used first, and would read what lies there.
void* refuse_uninitialised(std::size_t) {
    throw py::type_error("This object was never initialised: it was made by __new__ alone, or a class derived from it "
                         "does not call super().__init__().");
}

void mend_class(py::handle of, const py::object& reduce) {
    auto* const type = reinterpret_cast<PyTypeObject*>(of.ptr());
    if (auto* const info = py::detail::get_type_info(type)) info->operator_new = &refuse_uninitialised;
    py::setattr(of, "__reduce_ex__", reduce);
    for (const auto& [name, member] : py::dict(of.attr("__dict__"))) {
        if (py::isinstance(member, py::reinterpret_borrow<py::object>((PyObject*)&PyStaticMethod_Type)))
            mend_function(of.attr(name));
        else
            mend_function(member);
    }
}

} // namespace

void mend_calls(py::module_& m) {
    // Protocols 0 and 1 would make an object of pybind11's base; what protocol 2 says can be written by all of them.
    py::dict names;
    py::exec("def __reduce_ex__(self, protocol):\n"
             "    return object.__reduce_ex__(self, max(protocol, 2))\n",
             py::module_::import("builtins").attr("__dict__"), names);
    const py::object reduce = names["__reduce_ex__"];
    auto* const base = reinterpret_cast<PyTypeObject*>(py::detail::get_internals().instance_base);
    for (const auto& [name, member] : py::dict(m.attr("__dict__"))) {
        const bool is_class = PyType_Check(member.ptr()) && PyType_IsSubtype((PyTypeObject*)member.ptr(), base);
        is_class ? mend_class(member, reduce) : mend_function(member);
    }
}

} // namespace filigree::python
