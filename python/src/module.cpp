// relign_bench._core: scenes, instances, frames and trials for Python. The package's classes are its interface; this
// module takes and returns ids, JSON text and buffers.
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "bindings.h"

namespace relign::python {
namespace {

// An Error becomes the Python exception that callers expect, with its message.
void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const Error& error) {
    switch (error.kind()) {
      case ErrorKind::bad_input:
        PyErr_SetString(PyExc_ValueError, error.what());
        return;
      case ErrorKind::io:
        PyErr_SetString(PyExc_OSError, error.what());
        return;
      default:
        PyErr_SetString(PyExc_RuntimeError, error.what());
    }
  }
}

plugin_host::Kind kind_of(const std::string& name) {
  if (name == "scene") return plugin_host::Kind::scene;
  if (name == "noise-level") return plugin_host::Kind::noise_level;
  if (name == "algorithm") return plugin_host::Kind::optimizer;
  throw Error(ErrorKind::bad_input, "unknown kind '" + name + "'; kinds: scene, noise-level, algorithm");
}

}  // namespace

Json parameters_of(const std::string& text, const std::string& what) {
  if (text.empty()) return {};
  Json given = JsonSource::from_text(text, what).root();
  if (!given.is_object())
    throw Error(ErrorKind::bad_input, what + ": '" + text + "' must be an object of names with values");
  return given;
}

trials::Limits limits_of(const std::string& name) {
  if (name == "soft") return trials::Limits::soft;
  if (name == "hard") return trials::Limits::hard;
  throw Error(ErrorKind::bad_input, "unknown clipping '" + name + "'; clipping: soft, hard");
}

plugin_host::Choice choose(plugin_host::Catalog& catalog, plugin_host::Kind kind, const std::string& id,
                           const std::string& parameters) {
  return catalog.resolve_or_throw(kind, id, parameters_of(parameters, "parameters of " + id));
}

}  // namespace relign::python

PYBIND11_MODULE(_core, module) {
  using namespace relign::python;
  namespace plugin_host = relign::plugin_host;
  module.doc() = "The compiled module of relign_bench; use the package's own classes.";
  py::register_exception_translator([](std::exception_ptr thrown) { translate(thrown); });
  module.attr("__version__") = RELIGN_VERSION;
  module.def("cache_folder", [] { return relign::cache_folder().string(); });

  py::class_<plugin_host::Catalog>(module, "Catalog", "All plugins below some folders.")
      .def(py::init([](const std::vector<std::string>& roots) {
             auto catalog = std::make_unique<plugin_host::Catalog>();
             for (const std::string& root : roots)
               if (std::filesystem::is_directory(root)) catalog->scan(root);
             return catalog;
           }),
           py::arg("roots"))
      .def("add", [](plugin_host::Catalog& catalog, const std::string& path) { catalog.add(path); })
      .def("ids",
           [](const plugin_host::Catalog& catalog, const std::string& kind) { return catalog.ids(kind_of(kind)); })
      .def_property_readonly("refused", [](const plugin_host::Catalog& catalog) { return catalog.refused(); })
      .def("parameters", [](plugin_host::Catalog& catalog, const std::string& kind, const std::string& id) {
        return catalog.resolve_or_throw(kind_of(kind), id).parameters.dump();
      });
  bind_batch(module);
  bind_convolution(module);
  bind_trials(module);
}
