#include "plugin_host/choice_json.h"

#include <string>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/fault.h"
#include "base/json_members.h"
#include "plugin_host/process_manifest.h"

namespace relign::plugin_host {
namespace {

Choice read(const Json& json) {
  const std::string text = json.at("manifest").get<std::string>();
  const std::filesystem::path source = json.at("source").get<std::string>();
  Manifest manifest = is_plugin_script(source) ? script_manifest_of(text, source) : read_manifest_text(text, source);
  manifest.folder = json.at("folder").get<std::string>();
  manifest.library = json.at("library").get<std::string>();
  manifest.command = json.at("command").get<std::vector<std::string>>();
  Choice choice;
  choice.plugin = std::make_shared<const Manifest>(std::move(manifest));
  choice.id = json.at("id").get<std::string>();
  choice.parameters = json.at("parameters");
  choice.identity = json.at("identity").get<std::string>();
  for (const auto& [name, inner] : json.at("algorithms").items())
    choice.algorithms[name] = std::make_shared<const Choice>(read(inner));
  return choice;
}

constexpr std::size_t kShownHash = std::string_view("sha256:0123456789abcdef").size();

std::string name_below(const std::filesystem::path& folder, const std::filesystem::path& file) {
  const std::filesystem::path inside = file.lexically_relative(std::filesystem::absolute(folder).lexically_normal());
  return inside.empty() || *inside.begin() == ".." ? file.filename().string() : inside.generic_string();
}

}  // namespace

Json to_json(const Choice& choice) {
  Json algorithms = Json::object();
  for (const auto& [name, inner] : choice.algorithms) algorithms[name] = to_json(*inner);
  const Manifest& manifest = *choice.plugin;
  return {{"manifest", manifest.text},          {"source", manifest.source.string()},
          {"folder", manifest.folder.string()}, {"library", manifest.library.string()},
          {"command", manifest.command},        {"id", choice.id},
          {"parameters", choice.parameters},    {"identity", choice.identity},
          {"algorithms", std::move(algorithms)}};
}

Choice choice_from_json(const Json& json) {
  try {
    return read(json);
  } catch (const Json::exception& error) {
    throw Error(ErrorKind::internal, "malformed choice sent to a worker: " + json_fault(error));
  }
}

Json recorded_parameters(const Choice& choice) {
  Json recorded = choice.parameters;
  const Json identity = valid_json(choice.identity).at("parameters");
  for (const Parameter& parameter : choice.plugin->parameters) {
    if (parameter.added_later && !identity.contains(parameter.name)) recorded.erase(parameter.name);
    if (parameter.type != ParameterType::file || !recorded.contains(parameter.name)) continue;
    Json& value = recorded[parameter.name];
    const std::string content = text_of(identity, parameter.name.c_str());
    if (content.empty())  // the optional file was not given
      recorded.erase(parameter.name);
    else if (value.is_string())
      value = name_below(choice.plugin->folder, value.get<std::string>()) + " (" + content.substr(0, kShownHash) + ")";
  }
  return recorded;
}

}  // namespace relign::plugin_host
