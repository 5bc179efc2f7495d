#include "cli/workbench.h"

#include <cmath>
#include <sstream>

#include "base/error.h"
#include "base/json_source.h"
#include "trials/stage.h"

namespace relign::cli {

plugin_host::Choice named_choice(plugin_host::Catalog& catalog, plugin_host::Kind kind, const std::string& text,
                                 const std::string& option, const Json& parameters) {
  if (text.empty() || text.front() != '{') return catalog.resolve_or_throw(kind, text, parameters);
  const JsonSource source = JsonSource::from_text(text, option);
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  const std::string use = reader.required_string("use");
  reader.string("name", "");
  const Json* own = reader.get("parameters");
  if (own && !own->is_object())
    reader.complain("parameters", std::string("expected an object, found ") + own->type_name());
  if (own && !parameters.empty()) reader.complain("parameters", "also given by --parameters; give them in one place");
  reader.reject_unknown();
  throw_if_any(problems);
  return catalog.resolve_or_throw(kind, use, own ? *own : parameters);
}

LoadedScene load_scene(plugin_host::Choice choice, const plugin_host::HostServices& services) {
  LoadedScene loaded;
  forget_peak_memory();
  try {
    loaded.scene = std::make_unique<plugin_host::Scene>(choice, services);
    loaded.facts = trials::facts_of(*loaded.scene, choice.id);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    throw Error(ErrorKind::bad_input, "scene '" + choice.id + "' cannot be used: " + error.what());
  }
  loaded.memory_bytes = peak_memory_bytes();
  loaded.choice = std::move(choice);
  return loaded;
}

trials::Instance draw_instance(const plugin_host::Choice& level, const LoadedScene& scene,
                               const plugin_host::HostServices& services, std::uint64_t suite_seed,
                               std::uint64_t number) {
  return trials::draw_instance(level, level.id, scene.facts, scene.choice.id, services, suite_seed, number);
}

std::vector<double> parse_numbers(const std::string& text, const std::string& option) {
  std::vector<double> numbers;
  std::istringstream parts(text);
  std::string part;
  while (std::getline(parts, part, ',')) {
    std::istringstream number_text(part);
    number_text.imbue(std::locale::classic());
    double number = 0;
    char rest = 0;
    if (!(number_text >> number) || number_text >> rest || !std::isfinite(number))
      throw Error(ErrorKind::bad_input, option + ": '" + part + "' is not a number; expected comma-separated numbers");
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace relign::cli
