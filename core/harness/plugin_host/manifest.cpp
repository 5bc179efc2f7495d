#include "plugin_host/manifest.h"

#include <relign/plugin.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "base/inside.h"
#include "base/text.h"
#include "plugin_host/training.h"

namespace relign::plugin_host {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct NamedKind {
  Kind kind;
  const char* name;
};
constexpr NamedKind kKinds[] = {
    {Kind::scene, "scene"}, {Kind::noise_level, "noise-level"}, {Kind::optimizer, "optimizer"}, {Kind::agent, "agent"}};

struct NamedType {
  ParameterType type;
  const char* name;
};
constexpr NamedType kTypes[] = {{ParameterType::number, "number"},   {ParameterType::integer, "integer"},
                                {ParameterType::boolean, "boolean"}, {ParameterType::text, "text"},
                                {ParameterType::file, "file"},       {ParameterType::algorithm, "algorithm"},
                                {ParameterType::json, "json"}};

struct NamedKnowledge {
  std::uint32_t bit;
  const char* name;
};
constexpr NamedKnowledge kObservations[] = {{RELIGN_OBSERVES_IMAGES, "images"},  {RELIGN_OBSERVES_MERIT, "merit"},
                                            {RELIGN_OBSERVES_START, "start"},    {RELIGN_OBSERVES_BOX, "box"},
                                            {RELIGN_OBSERVES_DESIGN, "design"},  {RELIGN_OBSERVES_LEVEL, "level"},
                                            {RELIGN_OBSERVES_HISTORY, "history"}};

template <class Table>
std::vector<std::string> names_of(const Table& table) {
  std::vector<std::string> names;
  for (const auto& entry : table) names.push_back(entry.name);
  return names;
}

// Restricted because ids are typed in shells and written into file names and pages.
std::string check_id(const std::string& id) {
  const auto plain = [](char letter) {
    return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || (letter >= '0' && letter <= '9');
  };
  const bool fits =
      !id.empty() && id.size() <= 64 && plain(id[0]) && std::all_of(id.begin(), id.end(), [&](char letter) {
        return plain(letter) || letter == '-' || letter == '_' || letter == '.';
      });
  return fits
             ? ""
             : "expected 1 to 64 letters, digits, '-', '_' or '.', starting with a letter or digit, found '" + id + "'";
}

std::vector<std::string> read_texts(ObjectReader& reader, const std::string& key, bool may_repeat = false) {
  std::vector<std::string> texts;
  const Json* list = reader.get(key);
  if (!list) return texts;
  const bool fits = list->is_array() && std::all_of(list->begin(), list->end(), [](const Json& item) {
                      return item.is_string() && !item.get_ref<const std::string&>().empty();
                    });
  if (!fits) {
    reader.complain(key, "expected a list of strings");
    return texts;
  }
  texts = list->get<std::vector<std::string>>();
  if (!may_repeat && std::set<std::string>(texts.begin(), texts.end()).size() != texts.size())
    reader.complain(key, "duplicate entry");
  return texts;
}

Parameter read_one_parameter(const JsonSource& source, const std::string& pointer, const std::string& name,
                             std::vector<Problem>& problems) {
  ObjectReader reader(source, pointer, problems);
  Parameter parameter;
  parameter.name = name;
  const std::size_t problems_before = problems.size();
  const std::string type = reader.required_string("type");
  const auto* found =
      std::find_if(std::begin(kTypes), std::end(kTypes), [&](const NamedType& entry) { return type == entry.name; });
  if (found != std::end(kTypes))
    parameter.type = found->type;
  else if (!type.empty())
    reader.complain("type", "unknown type '" + type + "'; known: " + join(names_of(kTypes), ", "));
  const bool numeric = parameter.type == ParameterType::number || parameter.type == ParameterType::integer;
  for (const char* key : {"minimum", "maximum"}) {
    if (!reader.has(key)) continue;
    const double bound = reader.number(key, 0, -kInfinity, kInfinity);
    if (!numeric) reader.complain(key, "only a parameter of type number or integer has a range");
    (std::string(key) == "minimum" ? parameter.minimum : parameter.maximum) = bound;
  }
  if (parameter.minimum && parameter.maximum && *parameter.minimum > *parameter.maximum)
    reader.complain("minimum", "must not be larger than 'maximum'");
  parameter.allowed = read_texts(reader, "allowed");
  if (!parameter.allowed.empty() && parameter.type != ParameterType::text)
    reader.complain("allowed", "only a parameter of type text has a list of allowed values");
  parameter.unit = reader.string("unit", "");
  parameter.description = reader.string("description", "");
  if (const Json* value = reader.get("default")) parameter.default_value = *value;
  parameter.added_later = reader.boolean("added_later", false);
  if (parameter.added_later && parameter.default_value.is_null())
    reader.complain("added_later", "a parameter added later needs a default");
  if (parameter.added_later && parameter.type == ParameterType::file)
    reader.complain("added_later", "only for other types; a file is added later with the default \"\"");
  reader.reject_unknown();
  if (problems.size() == problems_before && !parameter.default_value.is_null())
    if (const std::string wrong = check_parameter(parameter, parameter.default_value); !wrong.empty())
      reader.complain("default", wrong);
  return parameter;
}

std::vector<Parameter> read_parameters(const JsonSource& source, ObjectReader& manifest,
                                       std::vector<Problem>& problems) {
  std::vector<Parameter> parameters;
  const Json* object = manifest.get("parameters");
  if (!object) return parameters;
  if (!object->is_object()) {
    manifest.complain("parameters", "expected an object");
    return parameters;
  }
  ObjectReader reader(source, "/parameters", problems);
  std::set<std::string> seen;
  for (const auto& [name, value] : object->items()) {
    if (const std::string wrong = check_id(name); !wrong.empty()) reader.complain(name, wrong);
    if (!seen.insert(normalised_name(name)).second) reader.complain(name, "duplicate parameter name ('-' equals '_')");
    if (!value.is_object()) {
      reader.complain(name, "expected an object with 'type'");
      continue;
    }
    parameters.push_back(read_one_parameter(source, reader.pointer_to(name), name, problems));
  }
  return parameters;
}

// The values of `key` (an object or missing) by the manifest's spelling of their names.
Json read_values(ObjectReader& reader, const std::string& key, const Manifest& manifest, const std::string& pointer,
                 const JsonSource& source, std::vector<Problem>& problems,
                 std::string (*check)(const Parameter&, const Json&) = check_parameter) {
  Json checked = Json::object();
  const Json* values = reader.get(key);
  if (!values) return checked;
  if (!values->is_object()) {
    reader.complain(key, "expected an object of parameters");
    return checked;
  }
  std::vector<std::string> names;
  for (const Parameter& parameter : manifest.parameters) names.push_back(parameter.name);
  ObjectReader inner(source, pointer + "/" + key, problems);
  for (const auto& [name, value] : values->items()) {
    const Parameter* parameter = manifest.parameter(name);
    if (!parameter) {
      inner.complain(name, "unknown parameter '" + name + "'" + suggestion(name, names));
      continue;
    }
    if (const std::string wrong = check(*parameter, value); !wrong.empty()) inner.complain(name, wrong);
    if (checked.contains(parameter->name)) inner.complain(name, "duplicate parameter");
    checked[parameter->name] = value;
  }
  return checked;
}

// A value for the design model, or for a text parameter an object that maps the trial's values to those of the model.
std::string check_model_parameter(const Parameter& parameter, const Json& value) {
  if (parameter.type != ParameterType::text || !value.is_object()) return check_parameter(parameter, value);
  for (const auto& [from, to] : value.items())
    for (const Json& one : {Json(from), to})
      if (const std::string wrong = check_parameter(parameter, one); !wrong.empty()) return wrong;
  return "";
}

std::int64_t read_version(ObjectReader& reader, std::int64_t fallback) {
  constexpr std::int64_t kHighest = 1000000;
  return reader.integer("version", fallback, 1, kHighest);
}

void read_presets(const JsonSource& source, ObjectReader& reader, Manifest& manifest, std::vector<Problem>& problems) {
  const Json* object = reader.get("presets");
  if (!object) return;
  if (!object->is_object()) {
    reader.complain("presets", "expected an object");
    return;
  }
  ObjectReader presets(source, "/presets", problems);
  std::set<std::string> seen = {normalised_name(manifest.id)};
  for (const auto& [id, value] : object->items()) {
    if (const std::string wrong = check_id(id); !wrong.empty()) presets.complain(id, wrong);
    if (!seen.insert(normalised_name(id)).second)
      presets.complain(id, "the plugin or another preset already has this name ('-' equals '_')");
    const std::string pointer = presets.pointer_to(id);
    ObjectReader one(source, pointer, problems);
    Preset preset;
    preset.id = id;
    preset.version = read_version(one, manifest.version);
    preset.summary = one.string("summary", "");
    preset.parameters = read_values(one, "parameters", manifest, pointer, source, problems);
    one.reject_unknown();
    manifest.presets.push_back(std::move(preset));
  }
}

void read_knowledge(ObjectReader& reader, Manifest& manifest) {
  const bool named = reader.has("observes");
  manifest.observes = read_texts(reader, "observes");
  manifest.oracle = reader.boolean("oracle", false);
  for (const std::string& entry : manifest.observes)
    if (std::none_of(std::begin(kObservations), std::end(kObservations),
                     [&](const NamedKnowledge& known) { return entry == known.name; }))
      reader.complain("observes", "unknown entry '" + entry + "'" + suggestion(entry, names_of(kObservations)));
  if (!is_algorithm(manifest.kind)) {
    if (named) reader.complain("observes", "only optimizers and agents declare observations");
    if (manifest.oracle) reader.complain("oracle", "only optimizers and agents can be oracles");
  } else if (manifest.oracle &&
             std::find(manifest.observes.begin(), manifest.observes.end(), "start") == manifest.observes.end()) {
    reader.complain("oracle", "an oracle gets the true start; add \"start\" to \"observes\"");
  }
}

constexpr const char* kOneFolder =
    ", which is outside the plugin's folder; keep all files of a plugin in its folder, so that it can be copied and "
    "hashed as a whole";

// A plugin is a library or, with "command", a process.
void read_way_to_run(ObjectReader& reader, Manifest& manifest) {
  manifest.command = read_texts(reader, "command", true);
  const std::string library = reader.string("library", manifest.id + ".so");
  if (library.empty()) reader.complain("library", "expected the library's file name");
  manifest.library = (manifest.folder / library).lexically_normal();
  if (!library.empty() && !is_inside(manifest.library, manifest.folder))
    reader.complain("library", "found '" + library + "'" + kOneFolder);
  if (!reader.has("command")) return;
  if (manifest.command.empty()) reader.complain("command", "expected a program and its arguments");
  if (reader.has("library"))
    reader.complain("command", "found 'command' and 'library'; expected one of them, not both");
  manifest.library = manifest.source;
  bool is_program = true, found = false;
  for (const std::string& word : manifest.command) {
    const std::filesystem::path file = (manifest.folder / word).lexically_normal();
    std::error_code error;
    const bool is_file = std::filesystem::is_regular_file(file, error);
    // The program itself may be outside of the folder: "/usr/bin/python3".
    const bool is_systems = std::exchange(is_program, false) && !word.empty() && word.front() == '/';
    if (!is_file || is_systems) continue;
    if (!is_inside(file, manifest.folder)) reader.complain("command", "found '" + word + "'" + kOneFolder);
    if (!std::exchange(found, true)) manifest.library = file;
  }
}

Json read_check(ObjectReader& reader, const Manifest& manifest) {
  const Json* given = reader.get("check");
  if (!given) return Json::object();
  if (!given->is_object()) {
    reader.complain("check", "expected an object of parameters");
    return Json::object();
  }
  for (const auto& [name, value] : given->items()) {
    const Parameter* parameter = manifest.parameter(name);
    if (!parameter)
      reader.complain("check", "unknown parameter '" + name + "'");
    else if (const std::string wrong = check_parameter(*parameter, value); !wrong.empty())
      reader.complain("check", name + ": " + wrong);
  }
  return *given;
}

Manifest read_checked(const JsonSource& source, const std::filesystem::path& file, std::vector<Problem>& problems) {
  Manifest manifest;
  manifest.text = source.text();
  manifest.source = std::filesystem::absolute(file).lexically_normal();
  manifest.folder = manifest.source.parent_path();
  if (!source.root().is_object()) {
    problems.push_back(source.problem("", "expected an object, the plugin's manifest"));
    return manifest;
  }
  ObjectReader reader(source, "", problems);
  manifest.id = reader.required_string("id");
  if (reader.has("id"))
    if (const std::string wrong = check_id(manifest.id); !wrong.empty()) reader.complain("id", wrong);
  const std::string kind = reader.required_string("kind");
  if (const auto known = kind_from_name(kind))
    manifest.kind = *known;
  else if (!kind.empty())
    reader.complain("kind", "unknown kind '" + kind + "'" + suggestion(kind, names_of(kKinds)));
  manifest.summary = reader.required_string("summary");
  if (reader.has("summary") && manifest.summary.empty())
    reader.complain("summary", "expected one sentence, found an empty string");
  manifest.version = read_version(reader, 1);
  manifest.license = reader.string("license", "");
  manifest.citation = reader.string("citation", "");
  manifest.reproducible = reader.string("reproducible", "anywhere");
  if (manifest.reproducible != "anywhere" && manifest.reproducible != "this_cpu")
    reader.complain("reproducible", "expected 'anywhere' or 'this_cpu', found '" + manifest.reproducible + "'");
  read_way_to_run(reader, manifest);
  read_knowledge(reader, manifest);
  manifest.parameters = read_parameters(source, reader, problems);
  read_presets(source, reader, manifest, problems);
  manifest.document = reader.string("document", "");
  if (!manifest.document.empty()) {
    const Parameter* parameter = manifest.parameter(manifest.document);
    if (!parameter || parameter->type != ParameterType::file)
      reader.complain("document", "expected the name of a parameter of type file, found '" + manifest.document + "'");
    else
      manifest.document = parameter->name;
  }
  read_pretraining(source, reader, manifest, problems);
  check_training(source, reader, manifest, problems);
  manifest.model_parameters =
      read_values(reader, "model_parameters", manifest, "", source, problems, check_model_parameter);
  if (reader.has("model_parameters") && manifest.kind != Kind::scene)
    reader.complain("model_parameters", "only scenes have a design model");
  manifest.check = read_check(reader, manifest);
  reader.reject_unknown();
  return manifest;
}

}  // namespace

const char* kind_name(Kind kind) {
  for (const NamedKind& entry : kKinds)
    if (entry.kind == kind) return entry.name;
  return "plugin";
}

std::optional<Kind> kind_from_name(const std::string& name) {
  for (const NamedKind& entry : kKinds)
    if (normalised_name(name) == entry.name) return entry.kind;
  return std::nullopt;
}

const Parameter* Manifest::parameter(const std::string& name) const {
  for (const Parameter& candidate : parameters)
    if (normalised_name(candidate.name) == normalised_name(name)) return &candidate;
  return nullptr;
}

const Preset* Manifest::preset(const std::string& wanted) const {
  for (const Preset& candidate : presets)
    if (normalised_name(candidate.id) == normalised_name(wanted)) return &candidate;
  return nullptr;
}

std::uint32_t Manifest::observed_bits() const {
  std::uint32_t bits = 0;
  for (const NamedKnowledge& known : kObservations)
    if (std::find(observes.begin(), observes.end(), known.name) != observes.end()) bits |= known.bit;
  return bits;
}

namespace {

template <class Read>
Manifest read_or_refuse(const std::filesystem::path& file, Read&& read) {
  try {
    const JsonSource source = read();
    std::vector<Problem> problems;
    Manifest manifest = read_checked(source, file, problems);
    throw_if_any(problems);
    return manifest;
  } catch (const Error& error) {
    throw Error(ErrorKind::plugin_rejected, error.what());
  }
}

}  // namespace

Manifest read_manifest(const std::filesystem::path& file) {
  return read_or_refuse(file, [&] { return JsonSource::from_file(file); });
}

Manifest read_manifest_text(const std::string& text, const std::filesystem::path& file) {
  return read_or_refuse(file, [&] { return JsonSource::from_text(text, file.string() + " --manifest"); });
}

std::string nesting_mistake(const Manifest& outer, const Manifest& inner, bool start_is_hidden) {
  const auto observes = [](const Manifest& manifest, std::uint32_t what) {
    return (manifest.observed_bits() & what) != 0;
  };
  const bool outer_has_start = outer.oracle || (!start_is_hidden && observes(outer, RELIGN_OBSERVES_START));
  if (inner.oracle && !outer_has_start)
    return "'" + inner.id + "' cannot run inside '" + outer.id +
           "': it is an oracle, which needs the start pose, and '" + outer.id + "' does not get it here; list '" +
           inner.id + "' as a method of its own, or use the protocol 'paper'";
  return "";
}

}  // namespace relign::plugin_host
