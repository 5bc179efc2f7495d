// relign-bench describe: prints a plugin or preset from its manifest, without loading it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>

#include "base/error.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/optimum_table.h"
#include "cli/text_table.h"

namespace relign::cli {
namespace {

using plugin_host::Kind;
using plugin_host::Manifest;
using plugin_host::Parameter;
using plugin_host::Preset;

const char* type_name(plugin_host::ParameterType type) {
  switch (type) {
    case plugin_host::ParameterType::number:
      return "number";
    case plugin_host::ParameterType::integer:
      return "integer";
    case plugin_host::ParameterType::boolean:
      return "boolean";
    case plugin_host::ParameterType::text:
      return "text";
    case plugin_host::ParameterType::file:
      return "file";
    case plugin_host::ParameterType::algorithm:
      return "algorithm";
    case plugin_host::ParameterType::json:
      return "json";
  }
  return "";
}

std::string number_text(double number) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.12g", number);
  return buffer;
}

std::string value_text(const Json& value) {
  if (value.is_null()) return "required";
  if (value.is_number_float()) return number_text(value.get<double>());
  const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  return text.empty() ? "-" : text;
}

std::string allowed_text(const Parameter& parameter) {
  if (!parameter.allowed.empty()) return join(parameter.allowed, ", ");
  if (parameter.minimum && parameter.maximum)
    return number_text(*parameter.minimum) + " to " + number_text(*parameter.maximum);
  if (parameter.minimum) return "from " + number_text(*parameter.minimum);
  if (parameter.maximum) return "up to " + number_text(*parameter.maximum);
  return "any";
}

// The preset's value, or the default.
Json shown_value(const Parameter& parameter, const Preset* preset) {
  if (preset != nullptr && preset->parameters.contains(parameter.name)) return preset->parameters.at(parameter.name);
  return parameter.default_value;
}

std::string readme_of(const Manifest& plugin) {
  const std::filesystem::path readme = plugin.folder / "README.md";
  return std::filesystem::exists(readme) ? readme.string() : "";
}

// A different allowed value: half, double, or the negation of a boolean; null if there is none.
Json another_value(const Parameter& parameter, const Json& value) {
  if (value.is_boolean()) return !value.get<bool>();
  if (!value.is_number()) return nullptr;
  const double now = value.get<double>();
  for (const double other : {now / 2, now * 2}) {
    const bool allowed =
        other != now && other >= parameter.minimum.value_or(other) && other <= parameter.maximum.value_or(other);
    if (!allowed) continue;
    if (!value.is_number_integer()) return other;
    if (other == std::floor(other)) return static_cast<std::int64_t>(other);
  }
  return nullptr;
}

// A command that tries another value of the first numeric or boolean parameter; empty if there is none.
std::string try_command(const Manifest& plugin, const Preset* preset) {
  if (!plugin_host::is_algorithm(plugin.kind)) return "";
  for (const Parameter& parameter : plugin.parameters) {
    const Json value = another_value(parameter, shown_value(parameter, preset));
    if (value.is_null()) continue;
    return own_command("try " + shell_quoted(preset == nullptr ? plugin.id : preset->id) + " --parameters " +
                       shell_quoted(Json{{parameter.name, value}}.dump()));
  }
  return "";
}

// "10 source instances, 100 steps each ..."; a count that is set by a parameter is shown as the parameter's name.
std::string pretraining_text(const Manifest& plugin) {
  const auto shown = [&plugin](const char* count) {
    const Json& stated = plugin.prepare.at(count);
    return stated.is_string() ? "'" + stated.get<std::string>() + "'" : stated.dump();
  };
  return shown("sources") + " source instances, " + shown("steps") +
         " steps each, once per scene, noise level and protocol";
}

std::string page(const Manifest& plugin, const Preset* preset) {
  const std::string id = preset == nullptr ? plugin.id : preset->id;
  std::string text =
      id + "  (" + plugin_host::kind_name(plugin.kind) + (preset == nullptr ? "" : ", preset of " + plugin.id) + ")\n";
  text += (preset == nullptr || preset->summary.empty() ? plugin.summary : preset->summary) + "\n\n";
  if (plugin_host::is_algorithm(plugin.kind))
    text += "observes      " + (plugin.observes.empty() ? "nothing" : join(plugin.observes, ", ")) +
            (plugin.oracle ? " (an oracle: observes the true start under every protocol)" : "") + "\n";
  if (!plugin.prepare.is_null()) text += "pretraining   " + pretraining_text(plugin) + "\n";
  text += "version       " + std::to_string(plugin.version_of(preset)) + "\n";
  text += "reproducible  " +
          std::string(plugin.reproducible == "this_cpu" ? "on the same kind of processor" : "on any machine") + "\n";
  if (!plugin.license.empty()) text += "licence       " + plugin.license + "\n";
  if (!plugin.citation.empty()) text += "citation      " + plugin.citation + "\n";
  if (const std::string readme = readme_of(plugin); !readme.empty()) text += "README        " + readme + "\n";

  if (!plugin.parameters.empty()) {
    TextTable table({"parameter", "type", preset == nullptr ? "default" : "value", "allowed", "unit", "meaning"});
    for (const Parameter& parameter : plugin.parameters)
      table.add({parameter.name, type_name(parameter.type), value_text(shown_value(parameter, preset)),
                 allowed_text(parameter), parameter.unit.empty() ? "-" : parameter.unit, parameter.description});
    text += "\n" + table.text();
    if (const std::string command = try_command(plugin, preset); !command.empty())
      text += "\nTry:\n  " + command + "\n";
  }
  if (preset == nullptr && !plugin.presets.empty()) {
    TextTable table({"preset", "changes", "meaning"});
    for (const Preset& each : plugin.presets) {
      std::vector<std::string> changes;
      for (const auto& [name, value] : each.parameters.items()) changes.push_back(name + "=" + value_text(value));
      table.add({each.id, changes.empty() ? "-" : join(changes, " "), each.summary});
    }
    text += "\n" + table.text();
  }
  return text;
}

Json to_json(const Manifest& plugin, const Preset* preset) {
  Json parameters = Json::array();
  for (const Parameter& parameter : plugin.parameters) {
    Json entry = {{"name", parameter.name},
                  {"type", type_name(parameter.type)},
                  {"value", shown_value(parameter, preset)},
                  {"unit", parameter.unit},
                  {"description", parameter.description}};
    if (parameter.minimum) entry["minimum"] = *parameter.minimum;
    if (parameter.maximum) entry["maximum"] = *parameter.maximum;
    if (!parameter.allowed.empty()) entry["allowed"] = parameter.allowed;
    parameters.push_back(entry);
  }
  Json presets = Json::array();
  for (const Preset& each : plugin.presets)
    presets.push_back({{"id", each.id}, {"summary", each.summary}, {"parameters", each.parameters}});
  return {{"id", preset == nullptr ? plugin.id : preset->id},
          {"plugin", plugin.id},
          {"kind", plugin_host::kind_name(plugin.kind)},
          {"version", plugin.version_of(preset)},
          {"summary", preset == nullptr ? plugin.summary : preset->summary},
          {"observes", plugin.observes},
          {"prepare", plugin.prepare},
          {"oracle", plugin.oracle},
          {"reproducible", plugin.reproducible},
          {"license", plugin.license},
          {"citation", plugin.citation},
          {"library", plugin.library.string()},
          {"readme", readme_of(plugin)},
          {"parameters", parameters},
          {"presets", presets}};
}

// The id itself, or the id of the plugin at this path.
std::string id_of(Context& context, const std::string& given) {
  std::error_code error;
  if (given.find('/') == std::string::npos && !std::filesystem::is_regular_file(given, error)) return given;
  if (std::filesystem::path(given).extension() == ".json" && std::filesystem::exists(given, error)) {
    const Json document = JsonSource::from_file(given).root();
    if (document.is_object() && document.contains("use") && document["use"].is_string())
      throw Error(ErrorKind::bad_input, given + " is an input file of '" + document["use"].get<std::string>() +
                                            "'; describe that plugin, or print a scene's lens with '" +
                                            own_command("lens info --scene FILE") + "'");
  }
  return context.catalog().add(given)->id;
}

struct DescribeArguments {
  std::string id;
  std::vector<std::string> levels;
  unsigned instances = 20;
};

int describe(Context& context, const DescribeArguments& arguments) {
  const std::string id = id_of(context, arguments.id);
  const std::size_t at = id.find('@');  // "ID@VERSION"
  const std::string name = id.substr(0, at);
  std::vector<std::string> known, pages;
  Json all = Json::array();
  for (const auto& plugin : context.catalog().plugins()) {
    known.push_back(plugin->id);
    for (const Preset& preset : plugin->presets) known.push_back(preset.id);
    const bool is_plugin = normalised_name(plugin->id) == normalised_name(name);
    const Preset* preset = is_plugin ? nullptr : plugin->preset(name);
    if (!is_plugin && preset == nullptr) continue;
    if (at != std::string::npos) plugin_host::require_version(name, plugin->version_of(preset), id.substr(at + 1));
    pages.push_back(page(*plugin, preset));
    all.push_back(to_json(*plugin, preset));
  }
  if (pages.empty()) {
    std::sort(known.begin(), known.end());
    throw Error(ErrorKind::bad_input, "unknown plugin or preset '" + name + "'" + suggestion(name, known));
  }
  if (!arguments.levels.empty()) {
    const std::vector<LevelOptima> optima = level_optima(context, id, arguments.levels, arguments.instances);
    pages.push_back(optima_text(optima));
    all.front()["own_optima"] = optima_json(optima);
  }
  // Several pages only if plugins of different kinds share the id.
  if (context.json)
    print_result((all.size() == 1 ? all.front() : all).dump(2) + "\n");
  else
    print_text(join(pages, "\n"));
  return kDone;
}

}  // namespace

void add_describe(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"describe", "Describe a plugin or preset: what it observes, parameters, presets.",
                                  "relign-bench describe nlopt-sbplx\n"
                                  "relign-bench describe relign_od --noise-level rho0.25 --noise-level rho0.5",
                                  "list, try"});
  DescribeArguments& given = add_action(verb, context, describe);
  verb.add_option("ID", given.id, "id of a plugin or preset, or path of a plugin")->required();
  verb.add_option("--noise-level", given.levels,
                  "for a scene: also print the distance of this level's optima from the nominal pose; repeatable")
      ->type_name("LEVEL")
      ->allow_extra_args(false);
  verb.add_option("--instances", given.instances, "number of instances per level, from instance 0 of suite seed 1")
      ->type_name("NUMBER")
      ->check(CLI::Range(1U, 10000U))
      ->capture_default_str();
}

}  // namespace relign::cli
