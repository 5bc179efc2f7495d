#include "plugin_host/choice_json.h"

#include <string>
#include <utility>

#include "base/error.h"
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
    throw Error(ErrorKind::internal, std::string("a choice sent to a worker cannot be read: ") + error.what());
  }
}

}  // namespace relign::plugin_host
