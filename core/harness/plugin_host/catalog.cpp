#include "plugin_host/catalog.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>
#include <tuple>

#include "base/fault.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "plugin_host/objects.h"
#include "plugin_host/parameters.h"
#include "plugin_host/process_manifest.h"

namespace relign::plugin_host {
namespace fs = std::filesystem;

namespace {

const char* const kManifestName = "relign-plugin.json";

bool same_namespace(Kind a, Kind b) { return a == b || (is_algorithm(a) && is_algorithm(b)); }

// The name of a namespace in messages.
std::string namespace_name(Kind kind) {
  if (is_algorithm(kind)) return "algorithm";
  return kind == Kind::scene ? "scene" : "noise level";
}

[[noreturn]] void reject(const std::string& message) { throw Error(ErrorKind::plugin_rejected, message); }

fs::path absolute_path(const fs::path& path) { return fs::absolute(path).lexically_normal(); }

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error) && !error;
}

// The manifest of a plugin given by its folder, library or manifest.
fs::path manifest_of(const fs::path& plugin) {
  std::error_code error;
  if (!fs::exists(plugin, error)) reject(plugin.string() + " does not exist");
  if (fs::is_directory(plugin, error)) {
    const fs::path manifest = plugin / kManifestName;
    if (!fs::exists(manifest, error)) reject(plugin.string() + " is not a plugin folder: it has no " + kManifestName);
    return manifest;
  }
  if (plugin.extension() != ".so") return plugin;  // a manifest, or a script that contains one
  const fs::path manifest = plugin.parent_path() / kManifestName;
  if (!fs::exists(manifest, error))
    reject(plugin.string() + " is not a plugin: there is no " + kManifestName + " beside it");
  return manifest;
}

// Folders with a manifest, sorted by name; each one once, even if several links lead to it.
void find_plugin_folders(const fs::path& folder, int depth, std::set<fs::path>& visited, std::vector<fs::path>& found) {
  constexpr int kMaxDepth = 8;
  std::error_code error;
  const fs::path canonical = fs::canonical(folder, error);
  if (error || depth > kMaxDepth || !visited.insert(canonical).second) return;
  if (fs::exists(folder / kManifestName, error)) {
    found.push_back(folder);
    return;  // folders below belong to this plugin
  }
  std::vector<fs::path> below;
  for (fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (entry->is_directory(unreadable)) below.push_back(entry->path());
  }
  std::sort(below.begin(), below.end());
  for (const fs::path& next : below) find_plugin_folders(next, depth + 1, visited, found);
}

void add_problem(std::vector<Problem>& problems, const std::string& message) {
  Problem problem;
  problem.message = message;
  problems.push_back(problem);
}

// Tells missing files ("tolerance.json") from unknown ids ("rho0.3").
bool has_file_extension(const std::string& name) {
  const std::string ending = fs::path(name).extension().string();
  constexpr std::size_t kMaxLength = 6;
  return ending.size() > 1 && ending.size() <= kMaxLength &&
         std::all_of(ending.begin() + 1, ending.end(), [](unsigned char letter) { return std::isalpha(letter) != 0; });
}

std::string missing_text(const fs::path& path) {
  std::vector<std::string> beside;
  std::error_code error;
  for (fs::directory_iterator entry(path.parent_path(), error), end; !error && entry != end; entry.increment(error))
    beside.push_back(entry->path().filename().string());
  const std::string nearest = nearest_name(path.filename().string(), beside);
  return path.string() + " does not exist" + (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
}

// Helps users who give a lens file instead of a scene made from it, or a folder instead of the document in it.
void refuse_near_misses(Kind kind, const fs::path& path) {
  std::error_code error;
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".zmx" || ending == ".seq" || ending == ".len")
    throw Error(ErrorKind::bad_input, path.string() + " is a lens file; create a scene with '" +
                                          own_command("scene new " + shell_quoted(path.filename().string())) +
                                          "' and use its scene.json");
  if (!fs::is_directory(path, error) || fs::exists(path / kManifestName, error)) return;
  const fs::path document = path / (kind == Kind::scene ? "scene.json" : "tolerances.json");
  if (!is_algorithm(kind) && fs::exists(document, error))
    throw Error(ErrorKind::bad_input, path.string() + " is not a plugin folder: it has no " + kManifestName +
                                          "; did you mean " + document.string() + "?");
}

}  // namespace

void require_version(const std::string& id, std::int64_t version, const std::string& wanted) {
  const std::string here = std::to_string(version);
  if (wanted == here) return;
  const bool is_number =
      !wanted.empty() && wanted.front() != '0' && wanted.find_first_not_of("0123456789") == std::string::npos;
  throw Error(ErrorKind::bad_input,
              is_number ? "'" + id + "@" + wanted + "' is not available: '" + id + "' has version " + here +
                              " here, which gives other numbers; use '" + id + "@" + here + "' or '" + id +
                              "', or a release with version " + wanted
                        : "'" + id + "@" + wanted + "' has no version: expected a whole number after '@'; '" + id +
                              "' has version " + here + " here");
}

// The result of looking up a name or path, before parameters are applied.
struct Catalog::Found {
  std::shared_ptr<const Manifest> plugin;
  const Preset* preset = nullptr;
  std::string id;
  fs::path document;  // empty: none
};

std::shared_ptr<const Manifest> Catalog::add(const fs::path& plugin) { return add_plugin(plugin); }

std::shared_ptr<const Manifest> Catalog::add_plugin(const fs::path& plugin) {
  const fs::path file = manifest_of(absolute_path(plugin));
  for (const auto& known : plugins_)
    if (same_file(known->source, file)) return known;
  if (is_plugin_script(file) && !starts_scripts_) reject(file.string() + " is a script, which is not started here");
  auto manifest = std::make_shared<const Manifest>(is_plugin_script(file) ? read_script_manifest(file, sandbox_.get())
                                                                          : read_manifest(file));
  std::error_code error;
  if (!fs::exists(manifest->library, error))
    reject(file.string() + ": its library " + manifest->library.string() +
           " does not exist; build the plugin, or correct 'library'");
  if (plugin.extension() == ".so" && !same_file(manifest->library, absolute_path(plugin)))
    reject(plugin.string() + " is not the library named in " + file.string() + " (" + manifest->library.string() + ")");

  std::vector<std::string> names = {manifest->id};
  for (const Preset& preset : manifest->presets) names.push_back(preset.id);
  for (const auto& known : plugins_) {
    if (!same_namespace(known->kind, manifest->kind)) continue;
    for (const std::string& name : names)
      if (normalised_name(known->id) == normalised_name(name) || known->preset(name))
        reject(file.string() + ": the " + namespace_name(manifest->kind) + " '" + name + "' already exists in " +
               known->folder.string() + "; rename one of them ('-' equals '_')");
  }
  plugins_.push_back(manifest);
  std::sort(plugins_.begin(), plugins_.end(),
            [](const auto& a, const auto& b) { return std::tie(a->kind, a->id) < std::tie(b->kind, b->id); });
  return manifest;
}

void Catalog::scan(const fs::path& root) {
  std::error_code error;
  if (!fs::is_directory(root, error)) {
    refused_.push_back(root.string() + " is not a folder");
    return;
  }
  std::set<fs::path> visited;
  std::vector<fs::path> folders;
  find_plugin_folders(absolute_path(root), 0, visited, folders);
  for (const fs::path& folder : folders) {
    try {
      add(folder);
    } catch (const std::exception& problem) {
      refused_.push_back(fault_text(problem));
    }
  }
}

std::vector<fs::path> Catalog::default_roots() {
  std::vector<fs::path> roots;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path own = program.parent_path().parent_path() / "lib" / "relign-bench" / "plugins";
    if (fs::is_directory(own, error)) roots.push_back(own);
  }
  const char* listed = std::getenv("RELIGN_PLUGIN_PATH");
  std::string rest = listed ? listed : "";
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    const std::string entry = rest.substr(0, colon);
    if (!entry.empty()) roots.emplace_back(entry);
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  return roots;
}

std::vector<std::string> Catalog::ids(Kind kind) const {
  std::vector<std::string> names;
  for (const auto& plugin : plugins_) {
    if (!same_namespace(plugin->kind, kind)) continue;
    names.push_back(plugin->id);
    for (const Preset& preset : plugin->presets) names.push_back(preset.id);
  }
  std::sort(names.begin(), names.end());
  return names;
}

Catalog::Found Catalog::find_name(Kind kind, const std::string& name) const {
  for (const auto& plugin : plugins_) {
    if (!same_namespace(plugin->kind, kind)) continue;
    if (normalised_name(plugin->id) == normalised_name(name)) return {plugin, nullptr, plugin->id, {}};
    if (const Preset* preset = plugin->preset(name)) return {plugin, preset, preset->id, {}};
  }
  return {};
}

std::string Catalog::unknown_text(Kind kind, const std::string& name) const {
  for (const Kind other : {Kind::scene, Kind::noise_level, Kind::optimizer})
    if (!same_namespace(other, kind) && find_name(other, name).plugin)
      return "'" + name + "' is a" + (is_algorithm(other) ? "n " : " ") + namespace_name(other) + "; expected " +
             (is_algorithm(kind) ? "an " : "a ") + namespace_name(kind);
  std::string text = "unknown " + namespace_name(kind) + " '" + name + "'" + suggestion(name, ids(kind));
  // If it exists but was refused, the user needs that reason.
  for (const std::string& refused : refused_)
    if (refused.find(name) != std::string::npos) return text + "\n  refused: " + refused;
  return text;
}

Catalog::Found Catalog::find(Kind kind, const std::string& id_or_path, const fs::path& relative_to,
                             bool documents_allowed) {
  const bool names_a_path = id_or_path.find('/') != std::string::npos;
  if (!names_a_path) {
    const std::size_t at = id_or_path.find('@');  // "ID@VERSION"
    if (Found found = find_name(kind, id_or_path.substr(0, at)); found.plugin) {
      if (at != std::string::npos)
        require_version(found.id, found.plugin->version_of(found.preset), id_or_path.substr(at + 1));
      return found;
    }
  }
  const fs::path path = absolute_path(relative_to / id_or_path);
  std::error_code error;
  if (id_or_path.empty() || !fs::exists(path, error)) {
    if (names_a_path || has_file_extension(id_or_path)) throw Error(ErrorKind::bad_input, missing_text(path));
    throw Error(ErrorKind::bad_input, unknown_text(kind, id_or_path));
  }
  refuse_near_misses(kind, path);

  if (path.extension() == ".json" && path.filename() != kManifestName) {
    const JsonSource source = JsonSource::from_file(path);
    if (source.root().is_object() && source.root().contains("use")) {
      const Json& use = source.root().at("use");
      const auto complain = [&](const std::string& message) { throw_if_any({source.problem("/use", message)}); };
      if (!documents_allowed) complain("a document cannot use another document");
      if (!use.is_string()) complain("expected the id of a " + namespace_name(kind));
      if (use.get_ref<const std::string&>().find('@') != std::string::npos)
        complain("expected an id without a version, found '" + use.get<std::string>() + "'");
      Found found;
      try {
        found = find(kind, use.get<std::string>(), path.parent_path(), false);
      } catch (const Error& problem) {
        if (problem.kind() == ErrorKind::plugin_rejected) throw;
        complain(problem.what());
      }
      if (found.plugin->document.empty()) complain("'" + found.plugin->id + "' does not take documents");
      if (found.preset && found.preset->parameters.contains(found.plugin->document))
        complain("'" + found.id + "' is a preset with a document of its own; use '" + found.plugin->id + "' instead");
      found.id = path.stem().string();
      found.document = path;
      return found;
    }
    if (!source.root().is_object() || !source.root().contains("kind"))
      throw Error(ErrorKind::bad_input, path.string() + " is neither a plugin's manifest nor a document with 'use'");
  } else if (!fs::is_directory(path, error) && path.extension() != ".so" && path.extension() != ".json" &&
             !is_plugin_script(path)) {
    throw Error(ErrorKind::bad_input, path.string() +
                                          " is not a plugin; expected a plugin's folder, its library (.so), " +
                                          "its Python script (.py), its manifest, or a JSON document with 'use'");
  }
  const auto plugin = add_plugin(path);
  if (!same_namespace(plugin->kind, kind))
    throw Error(ErrorKind::bad_input, path.string() + " is a plugin of the kind " + kind_name(plugin->kind) +
                                          "; expected " + (is_algorithm(kind) ? "an " : "a ") + namespace_name(kind));
  return {plugin, nullptr, plugin->id, {}};
}

Choice Catalog::choose(const Found& found, const Json& given, const fs::path& relative_to,
                       std::vector<Problem>& problems, int depth) {
  const std::size_t problems_before = problems.size();
  const Manifest& plugin = *found.plugin;
  Json all = given;
  if (!found.document.empty() && (given.is_null() || given.is_object())) {
    for (const auto& item : given.items())
      if (normalised_name(item.key()) == normalised_name(plugin.document))
        add_problem(problems, "the parameter '" + plugin.document + "' cannot be given: it is the document " +
                                  found.document.string());
    if (problems.size() == problems_before) all[plugin.document] = found.document.string();
  }
  EffectiveParameters effective = effective_parameters(plugin, found.preset, all, relative_to, problems);
  std::map<std::string, std::shared_ptr<const Choice>> algorithms;
  for (const Parameter& parameter : plugin.parameters) {
    if (parameter.type != ParameterType::algorithm || !effective.values.contains(parameter.name)) continue;
    const bool own =
        given.is_object() && std::any_of(given.items().begin(), given.items().end(), [&](const auto& item) {
          return normalised_name(item.key()) == normalised_name(parameter.name);
        });
    const auto inner = choose_inner(effective.values.at(parameter.name), own ? relative_to : plugin.folder,
                                    "/parameters/" + pointer_token(parameter.name), problems, depth + 1);
    if (!inner) continue;
    effective.identity[parameter.name] = valid_json(inner->identity);
    algorithms[parameter.name] = inner;
  }
  if (problems.size() != problems_before) return {};
  Json identity = {{"kind", kind_name(plugin.kind)}, {"parameters", effective.identity}, {"plugin", plugin.id}};
  if (const std::int64_t version = plugin.version_of(found.preset); version > 1) identity["version"] = version;
  return {found.plugin, found.id, effective.values, canonical_json(identity), std::move(algorithms)};
}

// Resolves the algorithm of a parameter: an id, preset or path, or {"use": ..., "parameters": {...}}. Null after a
// mistake.
std::shared_ptr<const Choice> Catalog::choose_inner(const Json& value, const fs::path& relative_to,
                                                    const std::string& pointer, std::vector<Problem>& problems,
                                                    int depth) {
  constexpr int kMaxDepth = 4;  // ends the recursion of an algorithm whose default is itself
  const std::size_t problems_before = problems.size();
  try {
    if (depth > kMaxDepth)
      throw Error(ErrorKind::bad_input, "algorithms that run algorithms are nested deeper than 4 levels");
    const std::string name = value.is_object() ? value.at("use").get<std::string>() : value.get<std::string>();
    const Json given = value.is_object() ? value.value("parameters", Json::object()) : Json::object();
    Choice inner = choose(find(Kind::optimizer, name, relative_to, true), given, relative_to, problems, depth);
    if (problems.size() == problems_before) return std::make_shared<const Choice>(std::move(inner));
  } catch (const Error& error) {
    add_problem(problems, error.what());
  }
  for (std::size_t i = problems_before; i < problems.size(); ++i) problems[i].pointer = pointer + problems[i].pointer;
  return nullptr;
}

Choice with_changes(const Choice& choice, const Json& changes) {
  std::vector<Problem> problems;
  Json all = choice.parameters;
  if (!changes.is_null() && !changes.is_object()) throw Error(ErrorKind::bad_input, "expected an object of parameters");
  for (const auto& [name, value] : changes.items()) {
    const Parameter* parameter = choice.plugin->parameter(name);
    if (parameter && parameter->type == ParameterType::algorithm)
      add_problem(problems, "the parameter '" + name + "' is an algorithm, which cannot be changed during a trial");
    all[parameter ? parameter->name : name] = value;
  }
  // Effective parameters are complete, so that presets and defaults have no effect here.
  const EffectiveParameters effective =
      effective_parameters(*choice.plugin, nullptr, all, choice.plugin->folder, problems);
  throw_if_any(problems);
  Choice changed = choice;
  changed.parameters = effective.values;
  Json identity = valid_json(choice.identity);
  identity["parameters"] = effective.identity;
  for (const auto& [name, inner] : choice.algorithms) identity["parameters"][name] = valid_json(inner->identity);
  changed.identity = canonical_json(identity);
  return changed;
}

Choice Catalog::resolve(Kind kind, const std::string& id_or_path, const Json& given, const fs::path& relative_to,
                        std::vector<Problem>& problems) {
  try {
    return choose(find(kind, id_or_path, relative_to, true), given, relative_to, problems);
  } catch (const Error& error) {
    add_problem(problems, error.what());
    return {};
  }
}

std::shared_ptr<const Manifest> Catalog::plugin_of(Kind kind, const std::string& id_or_path,
                                                   const fs::path& relative_to) {
  try {
    return find(kind, id_or_path, relative_to, true).plugin;
  } catch (const Error&) {
    return nullptr;
  }
}

Choice Catalog::resolve_or_throw(Kind kind, const std::string& id_or_path, const Json& given) {
  std::vector<Problem> problems;
  const fs::path here = fs::current_path();
  Choice choice = choose(find(kind, id_or_path, here, true), given, here, problems);
  throw_if_any(problems);
  return choice;
}

std::string plugin_hash(const Manifest& manifest) {
  std::string hashes = sha256_file(manifest.library);
  for (const std::string& word : manifest.command) {
    const fs::path file = (manifest.folder / word).lexically_normal();
    std::error_code error;
    if (file != manifest.library && fs::is_regular_file(file, error)) hashes += sha256_file(file);
  }
  return sha256_hex(hashes + sha256_hex(manifest.text));
}

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
