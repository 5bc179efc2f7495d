// relign-bench list: lists the available plugins and their presets.
#include "base/error.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/text_table.h"

namespace relign::cli {
namespace {

using plugin_host::Kind;
using plugin_host::Manifest;

// Accepts "scenes", "scene", "noise_levels", ...; "algorithms" are optimizers and agents.
bool (*kind_filter(const std::string& name))(Kind) {
  std::string wanted = normalised_name(name);
  if (!wanted.empty() && wanted.back() == 's') wanted.pop_back();
  if (wanted == normalised_name("scene")) return [](Kind kind) { return kind == Kind::scene; };
  if (wanted == normalised_name("noise-level")) return [](Kind kind) { return kind == Kind::noise_level; };
  if (wanted == normalised_name("optimizer")) return [](Kind kind) { return kind == Kind::optimizer; };
  if (wanted == normalised_name("agent")) return [](Kind kind) { return kind == Kind::agent; };
  if (wanted == normalised_name("algorithm")) return plugin_host::is_algorithm;
  if (wanted.empty()) return [](Kind) { return true; };
  throw Error(ErrorKind::bad_input,
              "unknown kind '" + name + "'" +
                  suggestion(name, {"scenes", "noise-levels", "algorithms", "optimizers", "agents"}));
}

Json to_json(const Manifest& plugin) {
  Json presets = Json::array();
  for (const plugin_host::Preset& preset : plugin.presets)
    presets.push_back({{"id", preset.id},
                       {"version", preset.version},
                       {"summary", preset.summary},
                       {"parameters", preset.parameters}});
  return {{"id", plugin.id},
          {"kind", plugin_host::kind_name(plugin.kind)},
          {"version", plugin.version},
          {"summary", plugin.summary},
          {"presets", presets}};
}

int list(Context& context, const std::string& kind) {
  const auto wanted = kind_filter(kind);
  Json all = Json::array();
  TextTable table({"kind", "id", "summary"});
  for (const auto& plugin : context.catalog().plugins()) {
    if (!wanted(plugin->kind)) continue;
    all.push_back(to_json(*plugin));
    table.add({plugin_host::kind_name(plugin->kind), plugin->id, plugin->summary});
    for (const plugin_host::Preset& preset : plugin->presets) table.add({"", "  " + preset.id, preset.summary});
  }
  print_result(context.json ? all.dump(2) + "\n" : table.text());
  return kDone;
}

}  // namespace

void add_list(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(
      app, {"list", "List the available plugins and their presets.", "relign-bench list algorithms", "describe, try"});
  auto kind = std::make_shared<std::string>();
  verb.add_option("KIND", *kind, "kind: scenes, noise-levels, algorithms, optimizers or agents [default: all]")
      ->type_name("KIND:{scenes,noise-levels,algorithms,optimizers,agents}");
  verb.callback([&context, kind] { context.action = [&context, kind] { return list(context, *kind); }; });
}

}  // namespace relign::cli
