#include "plugin_host/parameters.h"

#include <cmath>
#include <set>

#include "base/hash.h"
#include "base/text.h"

namespace relign::plugin_host {
namespace {

std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::string with_unit(const Parameter& parameter) { return parameter.unit.empty() ? "" : " (" + parameter.unit + ")"; }

std::string range_text(const Parameter& parameter, const char* kind) {
  std::string text = std::string("expected ") + kind;
  if (parameter.minimum && parameter.maximum)
    text += " from " + shortest(*parameter.minimum) + " to " + shortest(*parameter.maximum);
  else if (parameter.minimum)
    text += " of at least " + shortest(*parameter.minimum);
  else if (parameter.maximum)
    text += " of at most " + shortest(*parameter.maximum);
  return text + with_unit(parameter);
}

bool in_range(const Parameter& parameter, double value) {
  return std::isfinite(value) && (!parameter.minimum || value >= *parameter.minimum) &&
         (!parameter.maximum || value <= *parameter.maximum);
}

bool fits_int64(const Json& value) {
  return value.is_number_integer() &&
         (!value.is_number_unsigned() || value.get<std::uint64_t>() <= std::uint64_t{INT64_MAX});
}

// Gives equal values one form, so that 1 and 1.0 mean the same trial.
Json normalised(const Parameter& parameter, const Json& value) {
  if (parameter.type == ParameterType::number) return value.get<double>() + 0.0;  // -0 becomes 0
  if (parameter.type == ParameterType::integer) return value.get<std::int64_t>();
  return value;
}

bool is_empty_optional_file(const Parameter& parameter, const Json& value) {
  return parameter.type == ParameterType::file && value == "" && parameter.default_value == "";
}

}  // namespace

std::string check_parameter(const Parameter& parameter, const Json& value) {
  const std::string found = ", found " + shown(value);
  switch (parameter.type) {
    case ParameterType::number:
      if (value.is_number() && in_range(parameter, value.get<double>())) return "";
      return range_text(parameter, "a number") + found;
    case ParameterType::integer:
      if (fits_int64(value) && in_range(parameter, static_cast<double>(value.get<std::int64_t>()))) return "";
      return range_text(parameter, "an integer") + found;
    case ParameterType::boolean:
      return value.is_boolean() ? "" : "expected true or false" + found;
    case ParameterType::text: {
      if (!value.is_string()) return "expected a string" + found;
      if (parameter.allowed.empty()) return "";
      const auto text = value.get<std::string>();
      for (const std::string& allowed : parameter.allowed)
        if (text == allowed) return "";
      const std::string nearest = nearest_name(text, parameter.allowed);
      return "expected one of " + join(parameter.allowed, ", ") + found +
             (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
    }
    case ParameterType::file:
      if (is_empty_optional_file(parameter, value)) return "";
      return value.is_string() && !value.get_ref<const std::string&>().empty() ? "" : "expected a path" + found;
    case ParameterType::algorithm: {
      const auto names_one = [](const Json& name) {
        return name.is_string() && !name.get_ref<const std::string&>().empty();
      };
      if (names_one(value)) return "";
      const std::string expected = "expected an algorithm's id, or {\"use\": id, \"parameters\": {...}}" + found;
      if (!value.is_object() || !value.contains("use") || !names_one(value.at("use"))) return expected;
      for (const auto& item : value.items())
        if (item.key() != "use" && !(item.key() == "parameters" && item.value().is_object())) return expected;
      return "";
    }
    case ParameterType::json:
      return "";
  }
  return "";
}

std::string pointer_token(const std::string& name) {
  std::string token;
  for (const char letter : name) {
    if (letter == '~')
      token += "~0";
    else if (letter == '/')
      token += "~1";
    else
      token += letter;
  }
  return token;
}

EffectiveParameters effective_parameters(const Manifest& manifest, const Preset* preset, const Json& given,
                                         const std::filesystem::path& relative_to, std::vector<Problem>& problems) {
  const auto complain = [&problems](const std::string& pointer, const std::string& message) {
    Problem problem;
    problem.pointer = pointer;
    problem.message = message;
    problems.push_back(problem);
  };
  EffectiveParameters effective;
  if (!given.is_null() && !given.is_object()) {
    complain("/parameters", "expected an object, found " + shown(given));
    return effective;
  }

  // The user's spelling of each given parameter, for messages, by the manifest's spelling.
  std::map<std::string, std::string> spelled;
  std::vector<std::string> names;
  for (const Parameter& parameter : manifest.parameters) names.push_back(parameter.name);
  if (given.is_object()) {
    for (const auto& [name, value] : given.items()) {
      const std::string pointer = "/parameters/" + pointer_token(name);
      const Parameter* parameter = manifest.parameter(name);
      if (!parameter)
        complain(pointer, "'" + manifest.id + "' has no parameter '" + name + "'" +
                              (names.empty() ? "; it has no parameters" : suggestion(name, names)));
      else if (!spelled.emplace(parameter->name, name).second)
        complain(pointer, "duplicate parameter '" + parameter->name + "'");
    }
  }

  for (const Parameter& parameter : manifest.parameters) {
    Json value = parameter.default_value;
    std::filesystem::path base = manifest.folder;
    std::string pointer;
    if (preset && preset->parameters.is_object() && preset->parameters.contains(parameter.name))
      value = preset->parameters.at(parameter.name);
    if (const auto own = spelled.find(parameter.name); own != spelled.end()) {
      value = given.at(own->second);
      base = relative_to;
      pointer = "/parameters/" + pointer_token(own->second);
    }
    if (value.is_null() && parameter.type != ParameterType::json) {
      complain(pointer, "missing parameter '" + parameter.name + "'" +
                            (parameter.description.empty() ? "" : " (" + parameter.description + ")"));
      continue;
    }
    if (const std::string wrong = check_parameter(parameter, value); !wrong.empty()) {
      complain(pointer, parameter.name + ": " + wrong);
      continue;
    }
    if (is_empty_optional_file(parameter, value)) {  // not in the identity: ids do not change if a plugin adds one
      effective.values[parameter.name] = value;
      continue;
    }
    if (parameter.type != ParameterType::file) {
      effective.values[parameter.name] = normalised(parameter, value);
      effective.identity[parameter.name] = effective.values[parameter.name];
      continue;
    }
    const std::filesystem::path path = std::filesystem::absolute(base / value.get<std::string>()).lexically_normal();
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) {
      complain(pointer, parameter.name + ": " + path.string() +
                            (std::filesystem::exists(path, error) ? " is not a file" : " does not exist"));
      continue;
    }
    try {
      effective.identity[parameter.name] = "sha256:" + sha256_file(path);
      effective.values[parameter.name] = path.string();
    } catch (const Error& unreadable) {
      complain(pointer, parameter.name + ": " + unreadable.what());
    }
  }
  return effective;
}

}  // namespace relign::plugin_host
