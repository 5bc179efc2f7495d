#include "base/schema.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "base/json_members.h"
#include "base/json_places.h"
#include "base/text.h"

namespace relign {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kAnyCount = std::numeric_limits<std::size_t>::max();

// "1 to 3 numbers", "2 numbers", "at least 1 number".
std::string counted_range(std::size_t least, std::size_t most, const std::string& what) {
  if (least == most) return counted(least, what);
  if (least == 0) return "at most " + counted(most, what);
  if (most == kAnyCount) return "at least " + counted(least, what);
  return std::to_string(least) + " to " + counted(most, what);
}

std::string joined_values(const Json& list) {
  std::vector<std::string> words;
  for (const Json& value : list) words.push_back(value.is_string() ? value.get<std::string>() : value.dump());
  return join(words, ", ");
}

bool has_type(const Json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "number") return value.is_number();
  if (type == "boolean") return value.is_boolean();
  if (type == "null") return value.is_null();
  return value.is_number_integer() &&
         (!value.is_number_unsigned() || value.get<std::uint64_t>() <= std::uint64_t{INT64_MAX});
}

// Whether the rule's "type", one or a list, has the value's; true without "type".
bool allows_type(const Json& rule, const Json& value) {
  const Json& type = member(rule, "type");
  if (type.is_array())
    return std::any_of(type.begin(), type.end(), [&](const Json& one) { return has_type(value, one); });
  return type.is_null() || has_type(value, type);
}

class Checker {
 public:
  Checker(const Json& root, const JsonSource& source, std::vector<Problem>& problems)
      : root_(root), source_(source), problems_(problems) {}

  Json check(const Json& given_rule, const Json& value, const std::string& pointer) {
    if (given_rule.value("$comment", "") == "checked elsewhere") return value;
    const Json& rule = alternative(given_rule, value);
    if (const auto allowed = rule.find("enum"); allowed != rule.end()) {
      if (std::find(allowed->begin(), allowed->end(), value) != allowed->end()) return value;
      return wrong(rule, pointer, not_among(*allowed, value));
    }
    if (const auto only = rule.find("const"); only != rule.end())
      return *only == value ? value : wrong(rule, pointer, "found " + shown(value) + "; allowed: " + only->dump());
    const bool without_alternative = rule.contains("oneOf") && !rule.contains("type");
    if (without_alternative || !allows_type(rule, value) || !in_limits(rule, value))
      return wrong(rule, pointer, "expected " + words_of(given_rule) + ", found " + shown(value));
    if (value.is_object()) return check_object(rule, value, pointer);
    if (value.is_array()) return check_list(rule, value, pointer);
    return value;
  }

 private:
  const Json& resolved(const Json& rule) const {
    const auto link = rule.find("$ref");
    if (link == rule.end() || link->get_ref<const std::string&>().front() != '#') return rule;  // of another file
    return resolved(root_.at(Json::json_pointer(link->get<std::string>().substr(1))));
  }
  // The alternative of oneOf for the value's type; the rule itself without alternatives that differ in type.
  const Json& alternative(const Json& given_rule, const Json& value) const {
    const Json& rule = resolved(given_rule);
    const auto choices = rule.find("oneOf");
    if (choices == rule.end()) return rule;
    for (const Json& choice : *choices) {
      const Json& one = resolved(choice);
      if (one.contains("type") && allows_type(one, value)) return one;
    }
    return rule;
  }

  static bool in_limits(const Json& rule, const Json& value) {
    if (value.is_number()) {
      const auto number = value.get<double>();
      return number >= rule.value("minimum", -kInfinity) && number <= rule.value("maximum", kInfinity) &&
             number > rule.value("exclusiveMinimum", -kInfinity);
    }
    if (value.is_string()) {
      const std::size_t size = value.get_ref<const std::string&>().size();
      return size >= rule.value("minLength", std::size_t{0}) && size <= rule.value("maxLength", kAnyCount);
    }
    if (value.is_array())
      return value.size() >= rule.value("minItems", std::size_t{0}) &&
             value.size() <= rule.value("maxItems", kAnyCount);
    return true;
  }

  // What the rule expects: "a number from 0 to 1", "a list of 3 numbers".
  std::string words_of(const Json& given_rule) const {
    const Json& rule = resolved(given_rule);
    if (const auto choices = rule.find("oneOf"); choices != rule.end() && !rule.contains("type")) {
      std::vector<std::string> words;
      for (const Json& choice : *choices) words.push_back(words_of(choice));
      return join(words, " or ");
    }
    if (rule.contains("enum")) return "one of " + joined_values(rule["enum"]);
    const Json& type = member(rule, "type");
    if (type == "number" || type == "integer") return number_words(rule, type == "integer");
    if (type == "string") {
      if (rule.contains("maxLength"))
        return "a text of " + (rule.contains("minLength") ? rule["minLength"].dump() + " to " : "at most ") +
               rule["maxLength"].dump() + " characters";
      return rule.contains("minLength") ? "a text" : "a string";
    }
    if (type == "boolean") return "true or false";
    if (type == "array")
      return "a list of " + items_words(rule) +
             (rule.contains("description") ? " (" + rule["description"].get<std::string>() + ")" : "");
    if (type == "null") return "null";
    return type.is_array() ? "one of these types: " + joined_values(type) : "an object";
  }
  static std::string number_words(const Json& rule, bool integer) {
    const double least = rule.value("minimum", -kInfinity), most = rule.value("maximum", kInfinity);
    std::string words = integer ? "an integer" : "a number";
    if (rule.contains("exclusiveMinimum")) words += " above " + shortest(rule["exclusiveMinimum"].get<double>());
    if (least > -kInfinity) words += (most < kInfinity ? " from " : " of at least ") + shortest(least);
    if (most < kInfinity) words += (least > -kInfinity ? " to " : " of at most ") + shortest(most);
    return words;
  }
  std::string items_words(const Json& rule) const {
    const Json& items = resolved(member(rule, "items"));
    const Json& type = member(items, "type");
    const std::string one = type == "number"    ? "number"
                            : type == "integer" ? "integer"
                            : type == "string"  ? "text"
                            : type == "object"  ? "object"
                                                : "entry";
    const std::size_t least = rule.value("minItems", std::size_t{0}), most = rule.value("maxItems", kAnyCount);
    return least == 0 && most == kAnyCount ? (one == "entry" ? "entries" : one + "s") : counted_range(least, most, one);
  }
  static std::string not_among(const Json& allowed, const Json& value) {
    std::vector<std::string> names;
    for (const Json& one : allowed)
      if (one.is_string()) names.push_back(one.get<std::string>());
    const std::string nearest = value.is_string() ? nearest_name(value.get<std::string>(), names) : "";
    return "found " + (value.is_string() ? "'" + value.get<std::string>() + "'" : shown(value)) +
           "; allowed: " + joined_values(allowed) + (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
  }

  Json check_object(const Json& rule, const Json& value, const std::string& pointer) {
    static const Json none = Json::object();
    const auto listed = rule.find("properties");
    const Json& known = listed == rule.end() ? none : *listed;
    const Json& others = member(rule, "additionalProperties");
    Json made = Json::object();
    std::vector<std::string> names;
    for (const auto& [key, one] : known.items())
      if (key != "$schema") names.push_back(key);
    for (const auto& [key, one] : value.items()) {
      const std::string place = pointer + "/" + pointer_word(key);
      if (const auto found = known.find(key); found != known.end())
        made[key] = check(*found, one, place);
      else if (others.is_object())
        made[key] = check(others, one, place);
      else if (others != false)
        made[key] = one;
      else if (key != "$schema")
        problems_.push_back(source_.problem(place, "unknown key '" + key + "'" + suggestion(key, names)));
    }
    complete(rule, known, made, &pointer);
    return made;
  }
  // Defaults of absent keys, and allowed values for missing ones, which are problems unless `pointer` is null.
  void complete(const Json& rule, const Json& known, Json& made, const std::string* pointer) {
    for (const Json& key : list_of(rule, "required"))
      if (const auto& name = key.get_ref<const std::string&>(); !made.contains(name)) {
        const Json& one = known.at(name);
        if (pointer)
          problems_.push_back(source_.problem(*pointer, "missing key '" + name + "' (" + words_of(one) + ")"));
        made[name] = allowed_value(one);
      }
    for (const auto& [key, one] : known.items())
      if (const Json& otherwise = member(resolved(one), "default"); !otherwise.is_null() && !made.contains(key))
        made[key] = otherwise;
  }

  Json check_list(const Json& rule, const Json& value, const std::string& pointer) {
    const auto items = rule.find("items");
    Json made = Json::array();
    for (std::size_t i = 0; i < value.size(); ++i) {
      const std::string place = pointer + "/" + std::to_string(i);
      made.push_back(items == rule.end() ? value[i] : check(*items, value[i], place));
      if (rule.value("uniqueItems", false) &&
          std::count(value.begin(), value.begin() + static_cast<long>(i), value[i]) > 0)
        problems_.push_back(source_.problem(place, shown(value[i]) + " is listed twice; list each once"));
    }
    return made;
  }

  Json wrong(const Json& rule, const std::string& pointer, const std::string& message) {
    problems_.push_back(source_.problem(pointer, message));
    return allowed_value(rule);
  }
  Json allowed_value(const Json& given_rule) {
    const Json& rule = resolved(given_rule);
    for (const char* key : {"default", "const"})
      if (const auto found = rule.find(key); found != rule.end()) return *found;
    if (const auto found = rule.find("enum"); found != rule.end()) return found->front();
    if (const auto found = rule.find("oneOf"); found != rule.end() && !rule.contains("type"))
      return allowed_value(found->front());
    const Json& type = member(rule, "type");
    if (type == "number" || type == "integer") {
      const double value = std::clamp(std::max(0.0, rule.value("exclusiveMinimum", 0.0) + 1e-9),
                                      rule.value("minimum", -kInfinity), rule.value("maximum", kInfinity));
      return type == "integer" ? Json(static_cast<std::int64_t>(value)) : Json(value);
    }
    if (type == "string") return "";
    if (type == "boolean") return false;
    if (type == "array") {
      Json list = Json::array();
      for (std::size_t i = 0; i < rule.value("minItems", std::size_t{0}); ++i)
        list.push_back(rule.contains("items") ? allowed_value(rule["items"]) : Json());
      return list;
    }
    if (type != "object") return nullptr;
    Json object = Json::object();
    complete(rule, rule.value("properties", Json::object()), object, nullptr);
    return object;
  }

  const Json& root_;
  const JsonSource& source_;
  std::vector<Problem>& problems_;
};

// Sorts the problems that `check` adds by their places.
template <class Check>
Json in_order(std::vector<Problem>& problems, Check&& check) {
  const auto before = static_cast<std::ptrdiff_t>(problems.size());
  Json value = check();
  std::stable_sort(problems.begin() + before, problems.end(), [](const Problem& a, const Problem& b) {
    return std::tie(a.line, a.column) < std::tie(b.line, b.column);
  });
  return value;
}

}  // namespace

Schema::Schema(const unsigned char* bytes, std::size_t size)
    : root_(valid_json(std::string_view(reinterpret_cast<const char*>(bytes), size))) {}

Json Schema::checked(const JsonSource& source, std::vector<Problem>& problems) const {
  return in_order(problems, [&] { return Checker(root_, source, problems).check(root_, source.root(), ""); });
}

Json Schema::checked(const JsonSource& source, const std::string& pointer, const std::string& rule,
                     std::vector<Problem>& problems) const {
  return in_order(problems, [&] {
    return Checker(root_, source, problems)
        .check(root_.at(Json::json_pointer(rule)), source.root().at(Json::json_pointer(pointer)), pointer);
  });
}

}  // namespace relign
