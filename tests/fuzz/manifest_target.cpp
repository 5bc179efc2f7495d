// What a plugin says of itself: a manifest beside its library, and what a script answers.
#include "plugin_host/manifest.h"
#include "plugin_host/process_manifest.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  plugin_host::Manifest manifest;
  const bool read = fuzz::accepted([&] {
    manifest = plugin_host::read_manifest_text(text, fuzz::scratch_folder() / "relign-plugin.json");
    for (const plugin_host::Preset& preset : manifest.presets)
      fuzz::demand(manifest.preset(preset.id) != nullptr, "presets that are found");
    for (const plugin_host::Parameter& parameter : manifest.parameters)
      if (!parameter.default_value.is_null())
        fuzz::demand(plugin_host::check_parameter(parameter, parameter.default_value).empty(), "defaults that hold");
  });
  if (const Json said = parsed_json(text); said.is_object()) {
    fuzz::accepted([&] { plugin_host::script_manifest_of(text, fuzz::scratch_folder() / "made.py"); });
    if (read) {
      manifest.text = text;
      fuzz::demand(plugin_host::manifest_difference(manifest, said).empty(), "a manifest that equals itself");
    }
    plugin_host::Manifest other;
    other.text = R"({"kind": "optimizer", "parameters": {"kappa": {"type": "number", "default": 1}}})";
    plugin_host::manifest_difference(other, said);
  }
  return 0;
}
