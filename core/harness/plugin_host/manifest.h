// The manifest of a plugin: reads and checks the relign-plugin.json beside its library. Listing, describing and
// validating use only this and load nothing.
//
// {
//   "id": "compass", "kind": "optimizer", "summary": "One sentence.",
//   "observes": ["merit", "box"],
//   "parameters": {"first_stride": {"type": "number", "default": 0.1, "minimum": 0.001, "maximum": 0.5,
//                                   "unit": "share of the travel", "description": "..."}},
//   "presets": {"compass-wide": {"summary": "...", "parameters": {"first_stride": 0.3}}},
//   "license": "Apache-2.0", "citation": "...", "reproducible": "anywhere"
// }
// Required: id, kind, summary. Parameter types: number, integer, boolean, text (optional "allowed": [...]),
// file (a path, resolved against the file that names it), algorithm (the id of another one, or
// {"use": id, "parameters": {...}}), json (anything).
// Further keys:
// "library" (default ID.so), or "command": ["python3", "compass.py"] for a plugin that runs as a process in the
// manifest's folder (docs/process_plugins.md);
// "version": 2 (default 1), of the plugin or of a preset: raised when the same parameters and seed give other numbers
// than in a release, so that a suite can require "ID@1" (docs/releasing.md);
// "oracle": true, for an algorithm that gets the true start under every protocol (dashed in figures);
// "document": "scene": a JSON file with "use" may replace the plugin's id; its path becomes that parameter;
// "prepare": {"sources": 10, "steps": 100}, for an algorithm with pretraining on source instances (docs/services.md);
// each of the two is a number, or the name of an integer parameter;
// "model_parameters": {"transport": {"ghost": "fresnel"}, "errors": ""}, for a scene: values that its design model
// (service "model") has instead of those of the trial's scene; an object maps values of a text parameter; "check":
// {"other_scenes": true}, parameters with which `plugin check` runs it on synthetic trials.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::plugin_host {

enum class Kind { scene, noise_level, optimizer, agent };

const char* kind_name(Kind kind);                             // "noise-level"
std::optional<Kind> kind_from_name(const std::string& name);  // `-` equals `_`
inline bool is_algorithm(Kind kind) { return kind == Kind::optimizer || kind == Kind::agent; }

enum class ParameterType { number, integer, boolean, text, file, algorithm, json };

struct Parameter {
  std::string name;
  ParameterType type = ParameterType::number;
  Json default_value;  // null: a preset or the user must give the parameter
  std::optional<double> minimum;
  std::optional<double> maximum;
  std::vector<std::string> allowed;  // text: empty = any
  std::string unit;
  std::string description;
  bool added_later = false;  // not part of ids and records while it has its default
};

struct Preset {
  std::string id;
  std::int64_t version = 1;  // the plugin's, unless the preset has its own
  std::string summary;
  Json parameters;  // object, checked
};

struct Manifest {
  std::string id;
  Kind kind = Kind::optimizer;
  std::int64_t version = 1;  // raised when the same parameters and seed give other numbers than in a release
  std::string summary;
  std::vector<Parameter> parameters;
  std::vector<Preset> presets;
  std::vector<std::string> observes;  // images, merit, start, box, design, level, history
  bool oracle = false;
  std::string reproducible = "anywhere";  // or "this_cpu"
  std::string license;
  std::string citation;
  Json prepare;           // {"sources": ..., "steps": ...}, checked; null: no pretraining (pretraining.h)
  Json model_parameters;  // object, checked; only of a scene
  Json check;             // object of parameters, only for the conformance checks
  std::string document;   // name of the file parameter that a path with "use" fills; empty: none

  std::filesystem::path folder;  // of the manifest
  std::filesystem::path source;  // the manifest, or the script that contains it
  // Absolute path of the shared library. For a process: the first file within the folder in its command, else `source`.
  std::filesystem::path library;
  std::vector<std::string> command;  // for a process; empty for a library
  std::string text;                  // verbatim

  const Parameter* parameter(const std::string& name) const;  // null when there is none
  const Preset* preset(const std::string& id) const;          // `-` equals `_`
  // Of the preset, or with null of the plugin itself.
  std::int64_t version_of(const Preset* preset) const { return preset ? preset->version : version; }
  std::uint32_t observed_bits() const;  // RELIGN_OBSERVES_*
};

// Reads and checks a manifest file. Throws Error(plugin_rejected) that lists every mistake.
Manifest read_manifest(const std::filesystem::path& file);
// The same for the text of a manifest; `file` is its place in messages.
Manifest read_manifest_text(const std::string& text, const std::filesystem::path& file);

// Checks a value against a parameter. Returns a message, or an empty string when it is valid.
std::string check_parameter(const Parameter& parameter, const Json& value);

// Why `inner` cannot run inside `outer`, as a sentence; "" if it can. start_is_hidden: by the protocol or a station.
std::string nesting_mistake(const Manifest& outer, const Manifest& inner, bool start_is_hidden);

}  // namespace relign::plugin_host
