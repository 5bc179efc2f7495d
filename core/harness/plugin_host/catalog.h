// Finds plugins by id, preset or path, and resolves their parameters.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

struct Sandbox;  // sandbox.h

// A plugin with its effective parameters: the result of resolving an entry of a suite.
struct Choice {
  std::shared_ptr<const Manifest> plugin;
  std::string id;   // plugin id, preset id, or the file stem of a document
  Json parameters;  // effective: defaults, then preset, then given; file parameters are absolute paths
  // Canonical JSON, equal for equal plugins, parameters and contents of files on every machine: file parameters are
  // replaced by the SHA-256 of their content.
  std::string identity;
  // The resolved algorithms of parameters of type "algorithm", by the parameter's name.
  std::map<std::string, std::shared_ptr<const Choice>> algorithms;
};

// For a name "ID@WANTED". Throws Error(bad_input) unless that is the version of the plugin or preset here.
void require_version(const std::string& id, std::int64_t version, const std::string& wanted);

// A copy with some parameters changed (an object; null or {} for none); those of type "algorithm" cannot be changed.
// Throws Error(bad_input) that lists every mistake.
Choice with_changes(const Choice& choice, const Json& changes);

class Catalog {
 public:
  // Scripts are then asked for their manifests in a sandbox.
  void use_sandbox(std::shared_ptr<const Sandbox> sandbox) { sandbox_ = std::move(sandbox); }

  // Scripts that are not in the catalog are then refused, since their manifests are read by running them.
  void start_no_scripts() { starts_scripts_ = false; }

  // Adds a plugin: its folder, library, Python script or manifest. Throws Error(plugin_rejected), also
  // when an id or preset of the same namespace (scenes; noise levels; algorithms) exists already.
  // Adding the same folder again has no effect.
  std::shared_ptr<const Manifest> add(const std::filesystem::path& plugin);

  // Adds every folder below `root` that has a relign-plugin.json. Continues after a bad plugin and appends its error to
  // refused().
  void scan(const std::filesystem::path& root);

  // The folders that our programs scan: ../lib/relign-bench/plugins relative to the program's folder, then each entry
  // of RELIGN_PLUGIN_PATH.
  static std::vector<std::filesystem::path> default_roots();

  const std::vector<std::shared_ptr<const Manifest>>& plugins() const { return plugins_; }  // sorted by kind, id
  const std::vector<std::string>& refused() const { return refused_; }

  // Ids and presets of one namespace, sorted, for suggestions and completion.
  std::vector<std::string> ids(Kind kind) const;

  // Resolves an id, preset or path (a plugin's folder, library, script or manifest, or a JSON document
  // with "use"; relative to `relative_to`) and applies the parameters `given` (an object or null). Optimizers and
  // agents share a namespace. On mistakes appends to `problems` (without position; pointer relative to the entry: "" or
  // "/parameters/NAME") and returns an empty Choice (plugin is null).
  Choice resolve(Kind kind, const std::string& id_or_path, const Json& given, const std::filesystem::path& relative_to,
                 std::vector<Problem>& problems);

  // The same outside of a suite; throws Error(bad_input or plugin_rejected).
  Choice resolve_or_throw(Kind kind, const std::string& id_or_path, const Json& given = {});

  // The plugin that resolve() would choose, for any parameters; null after a mistake, which resolve() reports.
  std::shared_ptr<const Manifest> plugin_of(Kind kind, const std::string& id_or_path,
                                            const std::filesystem::path& relative_to);

 private:
  struct Found;
  std::shared_ptr<const Manifest> add_plugin(const std::filesystem::path& plugin);
  Found find_name(Kind kind, const std::string& name) const;  // plugin is null when there is none
  Found find(Kind kind, const std::string& id_or_path, const std::filesystem::path& relative_to,
             bool documents_allowed);  // throws Error
  Choice choose(const Found& found, const Json& given, const std::filesystem::path& relative_to,
                std::vector<Problem>& problems, int depth = 0);
  std::shared_ptr<const Choice> choose_inner(const Json& value, const std::filesystem::path& relative_to,
                                             const std::string& pointer, std::vector<Problem>& problems, int depth);
  std::string unknown_text(Kind kind, const std::string& name) const;

  std::vector<std::shared_ptr<const Manifest>> plugins_;
  std::vector<std::string> refused_;
  std::shared_ptr<const Sandbox> sandbox_;
  bool starts_scripts_ = true;
};

// A choice as JSON, complete, with the manifest's text, for a process that does not search plugins.
Json to_json(const Choice& choice);

// Throws Error(plugin_rejected) when the manifest cannot be read, Error(internal) when `json` did not come from
// to_json.
Choice choice_from_json(const Json& json);

// The effective parameters as results record them, equal on every machine: a file is given by its name (relative to the
// plugin's folder if it is inside) and the SHA-256 of its content: "imitation-ppo.onnx (sha256:1f0c9a2b3d4e5f60)".
Json recorded_parameters(const Choice& choice);

}  // namespace relign::plugin_host
