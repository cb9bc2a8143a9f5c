#include "errors.h"

#include <map>

namespace filigree::python {

namespace {

// They live as long as the interpreter.
std::map<ErrorCode, PyObject*>& error_classes() {
    static std::map<ErrorCode, PyObject*> classes;
    return classes;
}
PyObject* warning_class = nullptr;

void raise(const Error& error) { PyErr_SetString(error_classes().at(error.code), error.message.c_str()); }

py::object new_class(const char* name, const char* text, const py::tuple& bases) {
    PyObject* made = PyErr_NewExceptionWithDoc(("filigree." + std::string(name)).c_str(), text, bases.ptr(), nullptr);
    if (!made) throw py::error_already_set();
    return py::reinterpret_steal<py::object>(made);
}

} // namespace

void refuse(ErrorCode code, const std::string& sentence) { throw BadResultAccess({code, sentence}); }
void refuse(const std::string& sentence) { refuse(ErrorCode::usage, sentence); }

void warn(const std::vector<std::string>& sentences) {
    for (const std::string& sentence : sentences)
        if (PyErr_WarnEx(warning_class, sentence.c_str(), 1) != 0) throw py::error_already_set();
}

void add_errors(py::module_& m) {
    const auto of = [](PyObject* object) { return py::reinterpret_borrow<py::object>(object); };
    const py::object base =
        new_class("Error", "Base of all errors of Filigree. `code` is the exit code of the program for it.",
                  py::make_tuple(of(PyExc_Exception)));
    m.attr("Error") = base;
    base.attr("code") = 1;
    const auto add = [&](const char* name, ErrorCode code, PyObject* twin, const char* text) {
        const py::object made = new_class(name, text, twin ? py::make_tuple(base, of(twin)) : py::make_tuple(base));
        made.attr("code") = int(code);
        error_classes()[code] = made.inc_ref().ptr();
        m.attr(name) = made;
    };
    add("UsageError", ErrorCode::usage, PyExc_ValueError, "An argument makes no sense.");
    add("NotFoundError", ErrorCode::not_found, PyExc_FileNotFoundError, "A file cannot be opened or read.");
    add("BadFileError", ErrorCode::bad_file, PyExc_ValueError,
        "A file's content is damaged or not what its name says.");
    add("UnsupportedError", ErrorCode::unsupported, PyExc_NotImplementedError,
        "A format or feature that Filigree does not have.");
    add("UnwritableError", ErrorCode::unwritable, PyExc_OSError, "The output cannot be written.");
    add("UnsuitableError", ErrorCode::unsuitable, PyExc_ValueError,
        "The input is fine, but this method cannot work on it; the sentence says what can.");
    add("MismatchError", ErrorCode::mismatch, PyExc_ValueError,
        "Two inputs do not belong together, such as a pose and another model.");
    add("OutOfMemoryError", ErrorCode::out_of_memory, PyExc_MemoryError, "There is not enough memory.");
    add("Cancelled", ErrorCode::cancelled, nullptr, "The progress callback returned False.");

    const py::object warning = new_class("FiligreeWarning", "Something was mended, left out, or is doubtful.",
                                         py::make_tuple(of(PyExc_UserWarning)));
    m.attr("FiligreeWarning") = warning;
    warning_class = warning.inc_ref().ptr();

    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const BadResultAccess& failed) {
            raise(failed.error());
        } catch (const py::cast_error&) { // deep inside a list, a tuple or keywords
            PyErr_SetString(PyExc_TypeError,
                            "Something in a list, a tuple or keywords is not of the type that belongs there.");
        } catch (const std::bad_alloc&) {
            raise({ErrorCode::out_of_memory, "There is not enough memory for this."});
        }
    });
}

} // namespace filigree::python
