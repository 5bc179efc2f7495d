// Suites, with plugins of every kind of parameter to name.
#include "suites/suite.h"
#include "target.h"

using namespace relign;

namespace {

void add_plugin(const std::string& id, const std::string& manifest) {
  const std::filesystem::path folder = fuzz::scratch_folder() / "plugins" / id;
  std::filesystem::create_directories(folder);
  fuzz::write_scratch(folder / "relign-plugin.json", "{\"id\": \"" + id + "\", " + manifest + "}");
  fuzz::write_scratch(folder / (id + ".so"), "read by nobody");
}

plugin_host::Catalog& catalog() {
  static plugin_host::Catalog all = [] {
    add_plugin("toy", R"("kind": "scene", "summary": "A scene.", "document": "file",
      "parameters": {"file": {"type": "file", "default": "", "description": "A file."},
                     "white": {"type": "number", "default": 1, "minimum": 0, "maximum": 2, "description": "White."}})");
    add_plugin("rho", R"("kind": "noise-level", "summary": "A level.",
      "parameters": {"width": {"type": "number", "default": 0, "minimum": 0, "maximum": 1, "description": "Width."}},
      "presets": {"rho0.5": {"summary": "Half.", "parameters": {"width": 0.5}}})");
    add_plugin("bo-gp", R"("kind": "optimizer", "summary": "A search.", "observes": ["merit", "box"],
      "parameters": {"kappa": {"type": "integer", "default": 2, "minimum": 0, "maximum": 10, "description": "Kappa."},
                     "kernel": {"type": "text", "default": "rbf", "allowed": ["rbf", "matern"], "description": "K."},
                     "refine": {"type": "boolean", "default": false, "description": "R."},
                     "inner": {"type": "algorithm", "default": "home", "description": "Inner."},
                     "more": {"type": "json", "default": null, "description": "Anything."}})");
    add_plugin("home", R"("kind": "optimizer", "summary": "One move.", "observes": ["start"])");
    add_plugin("random", R"("kind": "optimizer", "summary": "Chance.", "observes": ["box"])");
    fuzz::write_scratch(fuzz::scratch_folder() / "scene.json", R"({"use": "toy", "name": "a scene"})");
    plugin_host::Catalog found;
    found.scan(fuzz::scratch_folder() / "plugins");
    fuzz::demand(found.refused().empty(), "the target's own plugins");
    return found;
  }();
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    const suites::Suite suite =
        suites::read_suite(JsonSource::from_text(text, "suite.json"), fuzz::scratch_folder(), catalog());
    fuzz::demand(!suite.scenes.empty() && !suite.levels.empty() && !suite.algorithms.empty(), "something to run");
    fuzz::demand(suite.text == text, "the suite verbatim");
    for (const suites::AlgorithmEntry& entry : suite.algorithms) {
      fuzz::demand(entry.choice.plugin != nullptr && entry.steps >= 1, "a whole entry");
      fuzz::demand(entry.name.find_first_of("/\n\x1b") == std::string::npos, "a name for tables and files");
    }
  });
  return 0;
}
