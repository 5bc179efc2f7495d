#include "submissions/evaluation_suite.h"

#include <algorithm>

#include "base/error.h"
#include "base/inside.h"
#include "base/text.h"

namespace relign::submissions {
namespace fs = std::filesystem;

namespace {

using plugin_host::Kind;

constexpr const char* kUse = "use";
constexpr const char* kParameters = "parameters";

bool is_id(const std::string& name, Kind kind, const plugin_host::Catalog& catalog) {
  const std::vector<std::string> ids = catalog.ids(kind);
  return std::any_of(ids.begin(), ids.end(),
                     [&](const std::string& id) { return normalised_name(id) == normalised_name(name); });
}

class Relocation {
 public:
  Relocation(const fs::path& relative_to, plugin_host::Catalog& catalog, const Relocate& relocate)
      : relative_to_(relative_to), catalog_(catalog), relocate_(relocate) {}

  Json entry(const Json& entry, Kind kind) const {
    if (entry.is_string()) return name(entry.get<std::string>(), kind);
    if (!entry.is_object() || !entry.contains(kUse) || !entry.at(kUse).is_string()) return entry;
    Json moved = entry;
    const std::string use = entry.at(kUse).get<std::string>();
    moved[kUse] = name(use, kind);
    const auto plugin = catalog_.plugin_of(kind, use, relative_to_);
    if (plugin && entry.contains(kParameters) && entry.at(kParameters).is_object())
      for (auto& [key, value] : moved[kParameters].items())
        if (const plugin_host::Parameter* parameter = plugin->parameter(key)) value = moved_value(*parameter, value);
    if (entry.contains("trainings") && entry.at("trainings").is_array())
      for (Json& file : moved["trainings"])
        if (file.is_string()) file = path(file.get<std::string>());
    return moved;
  }

 private:
  Json moved_value(const plugin_host::Parameter& parameter, const Json& value) const {
    if (parameter.type == plugin_host::ParameterType::algorithm) return entry(value, Kind::optimizer);
    if (parameter.type == plugin_host::ParameterType::file && value.is_string()) return path(value.get<std::string>());
    return value;
  }

  std::string path(const std::string& path) const {
    return path.empty() || fs::path(path).is_absolute() ? path : relocate_(path);
  }

  // As the catalog looks names up: an id, else a path.
  std::string name(const std::string& name, Kind kind) const {
    const bool names_a_path = name.find('/') != std::string::npos;
    if (!names_a_path && is_id(name, kind, catalog_)) return name;
    std::error_code error;
    return names_a_path || fs::exists(relative_to_ / name, error) ? path(name) : name;
  }

  const fs::path& relative_to_;
  plugin_host::Catalog& catalog_;
  const Relocate& relocate_;
};

bool is_installed(const fs::path& file) {
  const std::vector<fs::path> roots = plugin_host::Catalog::default_roots();
  return std::any_of(roots.begin(), roots.end(), [&](const fs::path& root) { return is_inside(file, root); });
}

}  // namespace

Json relocated(const Json& entry, Kind kind, const fs::path& relative_to, plugin_host::Catalog& catalog,
               const Relocate& relocate) {
  return Relocation(relative_to, catalog, relocate).entry(entry, kind);
}

Json submitted_entry(const Submission& submission, const fs::path& folder, const std::string& place,
                     plugin_host::Catalog& catalog) {
  const auto placed = [&place](const std::string& path) {
    return (fs::path(place) / path).lexically_normal().string();
  };
  std::string use = submission.use;
  if (!submission.plugin.empty()) {
    const auto plugin = catalog.add(folder / submission.plugin);
    if (!plugin_host::is_algorithm(plugin->kind))
      throw Error(ErrorKind::bad_input, std::string(kManifestName) + ": 'plugin' is a " + kind_name(plugin->kind) +
                                            "; only optimizers and agents can be submitted");
    if (normalised_name(plugin->id) != normalised_name(use))
      throw Error(ErrorKind::bad_input, std::string(kManifestName) + ": 'algorithm' uses '" + use +
                                            "', but the id of 'plugin' is '" + plugin->id + "'; make them equal");
    use = submission.plugin.find('/') == std::string::npos ? "./" + submission.plugin : submission.plugin;
  }
  Json entry = {{kUse, use}, {"name", submission.name}};
  if (!submission.parameters.empty()) entry[kParameters] = submission.parameters;
  if (!submission.merit.empty()) entry["merit"] = submission.merit;
  if (!submission.protocol.empty()) entry["protocol"] = submission.protocol;
  return relocated(entry, Kind::optimizer, folder, catalog, placed);
}

std::string evaluation_suite(const JsonSource& suite, const Json& entry, plugin_host::Catalog& catalog) {
  if (!suite.root().is_object()) throw_if_any({suite.problem("", "expected an object, the suite")});
  const fs::path folder = fs::absolute(suite.file()).lexically_normal().parent_path();
  const auto absolute = [&folder](const std::string& path) { return (folder / path).lexically_normal().string(); };
  Json moved = suite.root();
  moved.erase("$schema");
  for (const auto& [key, kind] : {std::pair("scenes", Kind::scene), std::pair("noise_levels", Kind::noise_level),
                                  std::pair("algorithms", Kind::optimizer)})
    if (moved.contains(key) && moved[key].is_array())
      for (Json& one : moved[key]) one = relocated(one, kind, folder, catalog, absolute);
  if (!moved.contains("algorithms") || !moved["algorithms"].is_array()) moved["algorithms"] = Json::array();
  const std::string name = entry.at("name").get<std::string>();
  for (const Json& one : moved["algorithms"])
    if (const Json own = one.is_object() ? one.value("name", one.value(kUse, Json())) : one; own == name)
      throw Error(ErrorKind::bad_input, "the suite '" + suite.file() + "' has an algorithm called '" + name +
                                            "' already; choose another name in " + kManifestName);
  moved["algorithms"].push_back(entry);
  if (!moved.contains("name")) moved["name"] = fs::path(suite.file()).stem().string();
  return moved.dump(2) + "\n";
}

void refuse_files_outside(const plugin_host::Choice& choice, const fs::path& folder) {
  const auto check = [&](const fs::path& file) {
    if (is_inside(file, folder) || is_installed(file)) return;
    throw Error(ErrorKind::bad_input, "the algorithm '" + choice.id + "' names '" + file.string() +
                                          "', which is outside the submission; put all its files into the submission");
  };
  check(choice.plugin->source);
  for (const plugin_host::Parameter& parameter : choice.plugin->parameters) {
    if (parameter.type != plugin_host::ParameterType::file || !choice.parameters.contains(parameter.name)) continue;
    const Json& file = choice.parameters.at(parameter.name);
    if (file.is_string() && file != "") check(file.get<std::string>());
  }
  for (const auto& [name, inner] : choice.algorithms) refuse_files_outside(*inner, folder);
}

}  // namespace relign::submissions
