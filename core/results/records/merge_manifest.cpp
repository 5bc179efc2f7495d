#include "records/merge_manifest.h"

#include <algorithm>

#include "base/error.h"
#include "base/json_members.h"
#include "base/limits.h"
#include "base/text.h"
#include "records/instances.h"
#include "records/manifest_check.h"
#include "records/processor.h"
#include "records/record.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

const Json& list(const Json& object, const char* key, const fs::path& folder) {
  const Json& value = member(object, key);
  const bool of_objects = std::string_view(key) == "algorithms";  // a noise level may be its name alone
  if (!value.is_array() ||
      (of_objects && std::any_of(value.begin(), value.end(), [](const Json& entry) { return !entry.is_object(); })))
    throw Error(ErrorKind::bad_input,
                (folder / "manifest.json").string() + " is damaged: expected a list '" + key + "'");
  return value;
}

std::string algorithm_key(const Json& entry) { return text_of(entry, "name") + "\n" + text_of(entry, "protocol"); }

std::string counted(const std::map<std::string, std::size_t>& values) {
  std::vector<std::string> parts;
  for (const auto& [value, folders] : values)
    parts.push_back((value.empty() ? "unknown" : value) + " (" + std::to_string(folders) +
                    (folders == 1 ? " folder)" : " folders)"));
  return join(parts, ", ");
}

}  // namespace

std::string name_and_protocol(const Json& algorithm) {
  return "'" + text_of(algorithm, "name") + "' (protocol " + text_of(algorithm, "protocol") + ")";
}

int ManifestJoin::place_of(const Names& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

int ManifestJoin::algorithm(const std::string& name, const std::string& protocol) const {
  return place_of(algorithms_, name + "\n" + protocol);
}

void ManifestJoin::add(const fs::path& folder, Json manifest) {
  for (const char* key : {"scenes", "noise_levels", "algorithms"}) list(manifest, key, folder);
  if (first_.is_null()) {
    first_folder_ = folder;
    first_ = manifest;
    for (const char* key : {"order", "sources", "suites", "merge", "shard", "plan"}) first_.erase(key);
    for (const Json& entry : first_["scenes"]) scenes_.push_back(text_of(entry, "name"));
    for (const Json& entry : first_["noise_levels"]) levels_.push_back(text_of(entry, "name"));
    for (const Json& entry : first_["algorithms"]) algorithms_.push_back(algorithm_key(entry));
  } else {
    join_lists(folder, manifest);
  }
  add_source(folder, manifest);
}

void ManifestJoin::join_lists(const fs::path& folder, const Json& manifest) {
  const std::string a = first_folder_.string(), b = folder.string();
  std::vector<std::string> different;
  if (text_of(first_, "instance_set") != text_of(manifest, "instance_set"))
    different =
        differing(first_, manifest, {"instance_set", "seed", "commitment", "first_instance", "instances"}, a, b);
  for (const std::string& message : different_scenes_and_levels(first_, manifest, true, a, b))
    different.push_back(message);
  // Not part of the instance set, but results that differ in them are not comparable.
  for (const std::string& message : differing(first_, manifest, {"limits", "machine_time", "cycle", "cost"}, a, b))
    different.push_back(message);
  if (!different.empty())
    throw Error(ErrorKind::bad_input,
                "cannot merge " + a + " and " + b + ": their scenes, noise levels, instances or limits differ:\n  " +
                    join(different, "\n  ") + "\nmake the suites equal in this and run one of them again");
  for (const Json& entry : manifest["algorithms"]) {
    const int place = place_of(algorithms_, algorithm_key(entry));
    if (place < 0) {
      algorithms_.push_back(algorithm_key(entry));
      first_["algorithms"].push_back(entry);
      continue;
    }
    Json& known = first_["algorithms"][static_cast<std::size_t>(place)];
    const auto other = differing(known, entry, {"plugin", "parameters", "merit", "steps"}, a, b);
    if (!other.empty())
      throw Error(ErrorKind::bad_input, "algorithm " + name_and_protocol(entry) + " of " + b +
                                            " differs from the algorithm of this name in the other folders:\n  " +
                                            join(other, "\n  ") +
                                            "\ngive one of them another \"name\" in its suite and run it again");
    // A suite that lists the algorithm overrides one where it was added automatically.
    if (!member(entry, "added").is_boolean() || !entry["added"].get<bool>()) known["added"] = false;
  }
  if (manifest.contains("secret")) first_["secret"] = manifest["secret"];
  if (member(first_, "spec") != member(manifest, "spec")) other_specs_.push_back(b);
  if (member(first_, "analysis") != member(manifest, "analysis")) other_analyses_.push_back(b);
  Json& learnt = first_["prepared"];
  if (!learnt.is_array()) learnt = Json::array();
  if (const Json& more = member(manifest, "prepared"); more.is_array())
    for (const Json& entry : more)
      if (std::find(learnt.begin(), learnt.end(), entry) == learnt.end()) learnt.push_back(entry);
}

std::size_t ManifestJoin::suite_number(const Json& suite) {
  const auto found = std::find(suites_.begin(), suites_.end(), suite);
  if (found != suites_.end()) return static_cast<std::size_t>(found - suites_.begin());
  suites_.push_back(suite);
  return suites_.size() - 1;
}

void ManifestJoin::add_source(const fs::path& folder, const Json& manifest) {
  const auto count = [this](const Json& source) {
    const Json& machine = member(source, "machine");
    if (std::none_of(processors_.begin(), processors_.end(),
                     [&machine](const Json& one) { return same_processor(one, machine); }))
      processors_.push_back(machine);
    ++cpus_[text_of(machine, "cpu")];
    ++flags_[text_of(member(source, "program"), "flags")];
    if (const Json& kinds = member(source, "plugins"); kinds.is_object())
      for (const auto& [kind, hashes] : kinds.items())
        if (hashes.is_object())
          for (const auto& [name, hash] : hashes.items())
            if (hash.is_string()) plugins_[name].insert(hash.get<std::string>());
  };
  for (const char* key : {"scenes", "noise_levels", "algorithms"})
    for (const Json& entry : manifest[key])
      if (text_of(entry, "reproducible") == "this_cpu") this_cpu_.insert(text_of(entry, "name"));

  // Replaces a merged folder by the folders that it was made of.
  if (const Json& inner = member(manifest, "sources"); inner.is_array() && !inner.empty()) {
    const Json& inner_suites = member(manifest, "suites");
    for (Json source : inner) {
      if (!source.is_object())
        throw Error(ErrorKind::bad_input,
                    (folder / "manifest.json").string() + " is damaged: expected objects in 'sources'");
      const Json& number = member(source, "suite");
      if (inner_suites.is_array() && number.is_number_unsigned() && number.get<std::size_t>() < inner_suites.size())
        source["suite"] = suite_number(inner_suites[number.get<std::size_t>()]);
      source["by_way_of"] = folder.string();
      count(source);
      sources_.push_back(std::move(source));
    }
    own_source_.push_back(static_cast<std::size_t>(-1));
    return;
  }
  Json source = {{"folder", folder.string()},
                 {"suite", suite_number({{"name", member(manifest, "suite_name")},
                                         {"file", member(manifest, "suite_file")},
                                         {"text", member(manifest, "suite")}})},
                 {"program", member(manifest, "program")},
                 {"machine", member(manifest, "machine")},
                 {"command", member(manifest, "command")}};
  for (const char* key : {"earlier_programs", "shard", "sandbox"})
    if (manifest.contains(key)) source[key] = manifest[key];
  for (const char* key : {"scenes", "noise_levels", "algorithms"})
    for (const Json& entry : manifest[key])
      source["plugins"][key][text_of(entry, "name")] = member(entry, "plugin_hash");
  count(source);
  own_source_.push_back(sources_.size());
  sources_.push_back(std::move(source));
}

bool ManifestJoin::may_differ_by_cpu(const std::string& scene, const std::string& level,
                                     const std::string& algorithm) const {
  return processors_.size() > 1 && (this_cpu_.count(scene) || this_cpu_.count(level) || this_cpu_.count(algorithm));
}

unsigned ManifestJoin::shards() const {
  Json plan;
  for (const Json& source : sources_) {
    const Json& shard = member(source, "shard");
    if (!shard.is_object() || !member(shard, "of").is_number_unsigned()) return 0;
    if (plan.is_null()) plan = shard;
    if (member(shard, "plan") != member(plan, "plan")) return 0;
  }
  // As many as trials: bounds the memory for a damaged file.
  return plan.is_null() ? 0
                        : static_cast<unsigned>(std::min<std::uint64_t>(plan["of"].get<std::uint64_t>(), kMaxTrials));
}

std::vector<unsigned> ManifestJoin::missing_shards() const {
  std::set<std::uint64_t> present;
  for (const Json& source : sources_)
    if (const Json& number = member(member(source, "shard"), "number"); number.is_number_unsigned())
      present.insert(number.get<std::uint64_t>());
  std::vector<unsigned> missing;
  for (unsigned number = 0, all = shards(); number < all; ++number)
    if (!present.count(number)) missing.push_back(number);
  return missing;
}

std::size_t ManifestJoin::sandboxed_sources() const {
  return static_cast<std::size_t>(
      std::count_if(sources_.begin(), sources_.end(), [](const Json& source) { return source.contains("sandbox"); }));
}

std::vector<std::string> ManifestJoin::notes() const {
  std::vector<std::string> messages;
  if (const std::size_t inside = sandboxed_sources(); inside > 0 && inside < sources_.size())
    messages.push_back("algorithms ran in a sandbox in " + std::to_string(inside) + " of " +
                       std::to_string(sources_.size()) + " folders");
  if (cpus_.size() > 1)
    messages.push_back("results from several processors; host times are not comparable: " + counted(cpus_));
  if (flags_.size() > 1) messages.push_back("relign-bench was built with different flags: " + counted(flags_));
  if (!other_specs_.empty())
    messages.push_back("using the spec of " + first_folder_.string() + "; a different one is in " +
                       join(other_specs_, ", "));
  if (!other_analyses_.empty())
    messages.push_back("using the analysis plan of " + first_folder_.string() + "; a different one, or none, is in " +
                       join(other_analyses_, ", "));
  if (const std::string note = builds_note({{"sources", sources_}}); !note.empty()) messages.push_back(note);
  for (const auto& [name, hashes] : plugins_)
    if (hashes.size() > 1)
      messages.push_back("plugin of '" + name + "': " + std::to_string(hashes.size()) +
                         " versions of its library; see \"sources\" in manifest.json");
  return messages;
}

Json ManifestJoin::joined(const std::vector<std::size_t>& taken) const {
  Json manifest = first_;
  manifest["format"] = kFormat;
  manifest["order"] = Json::array();
  manifest["suites"] = suites_;
  manifest["sources"] = sources_;
  if (sandboxed_sources() < sources_.size()) manifest.erase("sandbox");
  manifest.erase("earlier_programs");
  for (std::size_t folder = 0; folder < own_source_.size() && folder < taken.size(); ++folder)
    if (own_source_[folder] != static_cast<std::size_t>(-1))
      manifest["sources"][own_source_[folder]]["trials"] = taken[folder];
  return manifest;
}

}  // namespace relign::records
