// Shared by the files of the compiled module.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/json_source.h"
#include "plugin_host/catalog.h"
#include "trials/stage_motion.h"

namespace relign::python {

namespace py = pybind11;

// Arrays pass as buffers and lists, never by NumPy's C interface: one build then works with NumPy 1 and 2 and with the
// distribution's pybind11.
//
// The C-contiguous numbers behind an object with the buffer protocol. Throws Error(bad_input), which names `what`, for
// another type, shape or layout.
template <class Number>
Number* numbers_of(const py::buffer& buffer, const std::vector<std::size_t>& shape, bool writable, const char* what) {
  const py::buffer_info info = buffer.request(writable);
  bool fits =
      info.format == py::format_descriptor<Number>::format() && info.ndim == static_cast<py::ssize_t>(shape.size());
  py::ssize_t stride = sizeof(Number);
  for (std::size_t k = shape.size(); fits && k-- > 0;) {
    fits = info.shape[k] == static_cast<py::ssize_t>(shape[k]) && (info.shape[k] < 2 || info.strides[k] == stride);
    stride *= info.shape[k];
  }
  if (!fits) {
    std::string wanted;
    for (const std::size_t size : shape) wanted += (wanted.empty() ? "" : " x ") + std::to_string(size);
    throw Error(ErrorKind::bad_input, std::string(what) + " must be a contiguous array of " + wanted +
                                          " numbers of type '" + py::format_descriptor<Number>::format() + "'");
  }
  return static_cast<Number*>(info.ptr);
}

// Parameters from the text of a JSON object; "" for none.
Json parameters_of(const std::string& text, const std::string& what);

plugin_host::Choice choose(plugin_host::Catalog& catalog, plugin_host::Kind kind, const std::string& id,
                           const std::string& parameters);

// From "soft" or "hard". Throws Error(bad_input) for another name.
trials::Limits limits_of(const std::string& name);

void bind_batch(py::module_& module);
void bind_convolution(py::module_& module);
void bind_trials(py::module_& module);

}  // namespace relign::python
