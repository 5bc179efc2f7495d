// JSON Schema (draft 7) of structs that declare their members (base/described.h).
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "approved_document.h"
#include "base/described.h"
#include "base/scene_score.h"
#include "records/manifest.h"

namespace relign {

using OrderedJson = nlohmann::ordered_json;

// A struct's name among the "definitions", and what it is; "" for one that is described where it is used.
struct Definition {
  std::string_view name = {}, meaning = {};
};
template <class T>
inline constexpr Definition kDefinition = {};
template <>
inline constexpr Definition kDefinition<MachineTimeKeys> = {"machine_time",
                                                            "simulated clock: what moves and captures take"};
template <>
inline constexpr Definition kDefinition<records::Program> = {"program", "the relign-bench that wrote this"};
template <>
inline constexpr Definition kDefinition<records::Machine> = {"machine", "where it ran"};
template <>
inline constexpr Definition kDefinition<records::Shard> = {"shard", "which shard of a plan"};
template <>
inline constexpr Definition kDefinition<records::SandboxLimits> = {
    "sandbox", "of algorithms in a run with --sandbox. docs/sandbox.md"};

// Of a list separated by spaces.
inline OrderedJson words_of(std::string_view list) {
  OrderedJson all = OrderedJson::array();
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    all.push_back(list.substr(0, end));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return all;
}

class DescribedSchema {
 public:
  // Of a document, without its title.
  template <Described T>
  OrderedJson of_document() {
    OrderedJson schema = of_members<T>();
    if (!definitions_.empty()) schema["definitions"] = definitions_;
    return schema;
  }

 private:
  static void add_limits(OrderedJson& schema, const Member& member) {
    if (std::isfinite(member.least))
      schema[member.is(kAboveLeast) ? "exclusiveMinimum" : "minimum"] = static_cast<int>(member.least);
    if (std::isfinite(member.most)) schema["maximum"] = static_cast<int>(member.most);
  }

  OrderedJson of(const Member&, const bool&) { return {{"type", "boolean"}}; }
  template <std::unsigned_integral T>
  OrderedJson of(const Member& member, const T&) {
    const auto least = static_cast<unsigned>(std::max(0.0, member.least));
    if (member.least == member.most) return {{"const", least}};
    return {{"type", "integer"}, {"minimum", least}};
  }
  OrderedJson of(const Member& member, const double&) {
    OrderedJson schema = {{"type", member.is(kMayBeNull) ? OrderedJson({"number", "null"}) : OrderedJson("number")}};
    add_limits(schema, member);
    return schema;
  }
  OrderedJson of(const Member& member, const std::string&) {
    if (!member.one_of.empty()) return {{"enum", words_of(member.one_of)}};
    OrderedJson schema = {{"type", "string"}};
    if (!member.pattern.empty()) schema["pattern"] = member.pattern;
    return schema;
  }
  OrderedJson of(const Member& member, const Json&) {
    if (!member.schema.empty()) return {{"oneOf", OrderedJson::array({{{"$ref", member.schema}}, {{"type", "null"}}})}};
    if (!member.is(kAnyObject)) return OrderedJson::object();
    return {{"type", member.is(kMayBeNull) ? OrderedJson({"object", "null"}) : OrderedJson("object")}};
  }
  OrderedJson of(const Member& member, const SceneScore&) { return of(member, StatedScore()); }
  OrderedJson of(const Member& member, const records::Difference&) { return of(member, records::StatedDifference()); }
  template <class T>
  OrderedJson of(const Member& member, const std::optional<T>&) {
    if (member.is(kMayBeNull)) return {{"oneOf", OrderedJson::array({of(member, T()), {{"type", "null"}}})}};
    return of(member, T());
  }
  template <class T>
  OrderedJson of(const Member& member, const std::vector<T>&) {
    return {{"type", "array"}, {"items", of(member, T())}};
  }
  template <class T, std::size_t N>
  OrderedJson of(const Member& member, const std::array<T, N>&) {
    return {{"type", "array"}, {"items", of(member, T())}, {"minItems", N}, {"maxItems", N}};
  }
  template <class T>
  OrderedJson of(const Member& member, const std::map<std::string, T>&) {
    return {{"type", "object"}, {"additionalProperties", of(member, T())}};
  }
  template <Described T>
  OrderedJson of(const Member&, const T&) {
    const std::string name(kDefinition<T>.name);
    if (name.empty()) return of_members<T>();
    if (!definitions_.contains(name)) {
      definitions_[name] = nullptr;  // its place
      OrderedJson definition = of_members<T>();
      definition["description"] = kDefinition<T>.meaning;
      definitions_[name] = definition;
    }
    return {{"$ref", "#/definitions/" + name}};
  }

  template <Described T>
  OrderedJson of_members() {
    OrderedJson required = OrderedJson::array(), properties = OrderedJson::object();
    T usual{};
    T::members(
        [&](const Member& member, const auto& value) {
          const std::string key(member.key);
          if (!member.is(kLeftOut)) required.push_back(key);
          OrderedJson& schema = properties[key] = of(member, value);
          if (member.meaning.empty()) return;
          if (schema.contains("$ref")) schema = {{"allOf", OrderedJson::array({schema})}};
          schema["description"] = member.meaning;
        },
        usual);
    OrderedJson schema = {{"type", "object"}};
    if (!required.empty()) schema["required"] = required;
    schema["properties"] = properties;
    schema["additionalProperties"] = false;
    return schema;
  }

  OrderedJson definitions_ = OrderedJson::object();
};

// The schema in docs/schemas.
template <Described T>
void approve_schema(const std::string& name, const std::string& title, const std::string& description) {
  OrderedJson schema = {
      {"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}, {"description", description}};
  schema.update(DescribedSchema().of_document<T>());
  const std::filesystem::path file =
      std::filesystem::path(RELIGN_SOURCE_DIR) / "docs/schemas" / (name + ".schema.json");
  test::approve(file, test::pretty(schema) + "\n");
}

}  // namespace relign
