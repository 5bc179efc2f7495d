#include "records/manifest_check.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/baselines.h"
#include "base/characters.h"
#include "base/commitment.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/shared_keys.h"
#include "base/text.h"

namespace relign::records {
namespace {

constexpr std::size_t kShownEntry = 60;                                     // characters
constexpr const char* kLists[] = {"scenes", "noise_levels", "algorithms"};  // that a suite must have

// What name_in_suite can read. Without this check an entry without a name would stand for every method without a list.
bool is_entry(const Json& entry) {
  return entry.is_string() ? !entry.get_ref<const std::string&>().empty()
                           : !text_of(entry, "use").empty() || !text_of(entry, "name").empty();
}

void check_entries(std::vector<std::string>& found, const Json& suite) {
  for (const char* key : kLists)
    for (const Json& entry : list_of(suite, key))
      if (!is_entry(entry))
        found.push_back("the suite has the entry " + entry.dump().substr(0, kShownEntry) + " in " + in_quotes(key) +
                        "; expected an id or an object with 'use'");
}

// The suite texts of a folder as JSON; without any, one without members.
std::vector<Json> suites_of(std::vector<std::string>& found, const Manifest& manifest) {
  std::vector<Json> suites;
  for (const StoredSuite& stored : manifest.stored_suites()) {
    suites.push_back(stored.text.empty() ? Json::object() : parsed_json(stored.text));
    if (suites.back().is_object()) continue;
    found.push_back("the text of the suite is not a JSON object");
    suites.pop_back();
  }
  return suites;
}

void check_commitment(std::vector<std::string>& found, const Json& suite, const std::string& commitment) {
  const std::string stated = text_of(suite, "commitment");
  if (stated == commitment) return;
  if (stated.empty())
    found.push_back("the suite is open, since it has no commitment, but 'commitment' is " + in_quotes(commitment));
  else
    found.push_back("the suite has the commitment " + in_quotes(stated) + ", but 'commitment' is " +
                    in_quotes(commitment));
}

void check_secret(std::vector<std::string>& found, const Manifest& manifest) {
  if (manifest.secret.empty()) return;
  if (!manifest.sealed()) {
    found.push_back("there is a 'secret', but no commitment");
  } else if (const std::string own = commitment_to(manifest.secret); own != manifest.commitment) {
    found.push_back("'secret' has the commitment " + in_quotes(own) + ", but 'commitment' is " +
                    in_quotes(manifest.commitment));
  }
}

// How an entry of a suite is called; nullopt: as the document or plugin at a path.
std::optional<std::string> name_in_suite(const Json& entry) {
  if (entry.is_object() && member(entry, "name").is_string()) return text_of(entry, "name");
  const std::string use = entry.is_string() ? entry.get<std::string>() : text_of(entry, "use");
  const auto ends_with = [&use](std::string_view ending) {
    return use.size() >= ending.size() && use.compare(use.size() - ending.size(), ending.size(), ending) == 0;
  };
  if (use.find('/') != std::string::npos || ends_with(".json") || ends_with(".py") || ends_with(".so"))
    return std::nullopt;
  return use.substr(0, use.find('@'));  // without the version of "ID@VERSION"
}

void check_places(std::vector<std::string>& found, const Json& suite, const char* key,
                  const std::vector<std::string>& names) {
  if (list_of(suite, key).empty()) return;
  std::set<std::string> in_suite, in_manifest;
  bool all_known = true;
  for (const std::string& name : names) in_manifest.insert(normalised_name(name));
  for (const Json& entry : list_of(suite, key)) {
    const std::optional<std::string> name = name_in_suite(entry);
    all_known = all_known && name;
    if (!name) continue;
    in_suite.insert(normalised_name(*name));
    if (!in_manifest.count(normalised_name(*name)))
      found.push_back("the suite has " + in_quotes(*name) + " in " + in_quotes(key) + ", the manifest does not");
  }
  for (const std::string& name : names)
    if (all_known && !in_suite.count(normalised_name(name)))
      found.push_back("the manifest has " + in_quotes(name) + " in " + in_quotes(key) + ", the suite does not");
}

std::vector<std::string> protocols_of(const Json& entry, const std::vector<std::string>& usual) {
  std::vector<std::string> protocols;
  for (const Json& one : list_of(entry, "protocols"))
    protocols.push_back(one.is_string() ? one.get<std::string>() : "");
  if (protocols.empty() && member(entry, "protocol").is_string()) protocols.push_back(text_of(entry, "protocol"));
  return protocols.empty() ? usual : protocols;
}

std::string method_text(const std::string& name, const std::string& protocol) {
  return in_quotes(name) + " (protocol " + protocol + ")";
}

// The methods of the manifest against those of all its suites, whose entries have defaults.
void check_methods(std::vector<std::string>& found, const std::vector<Json>& suites, const Manifest& manifest) {
  if (!std::all_of(suites.begin(), suites.end(), [](const Json& suite) { return is_suite(suite); })) return;
  const bool station = std::any_of(manifest.scenes.begin(), manifest.scenes.end(),
                                   [](const ManifestScene& scene) { return scene.owns_stage; });
  bool all_known = !suites.empty();
  std::set<std::pair<std::string, std::string>> planned;
  for (const Json& suite : suites)
    for (const Json& entry : list_of(suite, "algorithms")) {
      const std::optional<std::string> name = name_in_suite(entry);
      all_known = all_known && name;
      if (!name) continue;
      for (const std::string& protocol : protocols_of(entry, protocols_of(suite, {"paper"}))) {
        planned.insert({normalised_name(*name), protocol});
        bool listed = false;
        for (const ManifestMethod& method : manifest.algorithms) {
          if ((normalised_name(method.name) != normalised_name(*name) &&
               normalised_name(method.listed_name()) != normalised_name(*name)) ||
              method.protocol != protocol)
            continue;
          listed = true;
          const auto compare = [&](const char* key, const Json& expected, const Json& stated) {
            if (stated != expected)
              found.push_back(in_quotes(key) + " of " + method_text(*name, protocol) + " is " + expected.dump() +
                              " in the suite and " + stated.dump() + " in the manifest");
          };
          const Json &steps = member(entry, "steps"), &usual = member(suite, "steps"), &merit = member(entry, "merit");
          compare("steps", !steps.is_null() ? steps : !usual.is_null() ? usual : Json(kDefaultSteps), method.steps);
          compare("merit", !merit.is_null() ? merit : Json(protocol == "blind" ? "rmse" : "combined"), method.merit);
        }
        if (!listed && !station)  // which leaves out methods that need its true start
          found.push_back("the suite has the method " + method_text(*name, protocol) + ", the manifest does not");
      }
    }
  for (const ManifestMethod& method : manifest.algorithms) {
    const std::string text = method_text(method.name, method.protocol);
    const bool of_suite = planned.count({normalised_name(method.name), method.protocol}) > 0,
               of_list = planned.count({normalised_name(method.listed_name()), method.protocol}) > 0;
    if (all_known && method.of_list &&
        (!of_list || method.name != method.listed_name() + " (" + method.of_list->training + ")"))
      found.push_back("'of_list' of " + text + " names no training of a method of the suite");
    if (method.added) {
      if (std::find(kBaselines.begin(), kBaselines.end(), method.name) == kBaselines.end())
        found.push_back("the manifest has the method " + text + " as added by the program, which adds baselines only");
    } else if (all_known && !of_suite && !of_list) {
      found.push_back("the manifest has the method " + text + ", the suite does not");
    }
  }
}

// What needs no suite: whether a method is ranked, and in which class.
void check_oracles(std::vector<std::string>& found, const Manifest& manifest) {
  for (const ManifestMethod& method : manifest.algorithms) {
    if (!method.oracle) continue;
    if (method.protocol == "paper")
      found.push_back(method_text(method.name, method.protocol) +
                      " is marked as an oracle, but this protocol gives the true start to every method");
    else if (std::find(method.observes.begin(), method.observes.end(), "start") == method.observes.end())
      found.push_back(method_text(method.name, method.protocol) +
                      " is marked as an oracle, but does not observe the true start");
  }
}

void check_suite_name(std::vector<std::string>& found, const Json& suite, const Manifest& manifest) {
  std::string own = text_of(suite, "name");
  if (own.empty()) own = std::filesystem::path(manifest.suite_file).stem().string();
  if (!own.empty() && own != manifest.suite_name)
    found.push_back("'suite_name' is " + in_quotes(manifest.suite_name) + ", but the suite is called " +
                    in_quotes(own));
}

// A key that is in both as the suite has it; `usual` is what a suite without the key has.
void check_member(std::vector<std::string>& found, const Json& suite, const char* key, const Json& stated,
                  const Json& usual) {
  const Json &written = member(suite, key), &expected = written.is_null() ? usual : written;
  if (expected != stated)
    found.push_back(in_quotes(key) + " is " + expected.dump() + " in the suite and " + stated.dump() +
                    " in the manifest");
}

// A folder without its suite has nothing to compare with.
void check_number(std::vector<std::string>& found, const Json& suite, const char* key, std::uint64_t stated,
                  unsigned usual) {
  if (suite.contains(key) || is_suite(suite)) check_member(found, suite, key, stated, usual);
}

// Of an object whose members have defaults.
template <class T>
void check_stated(std::vector<std::string>& found, const Json& suite, const char* key, const std::optional<T>& stated) {
  const Json& written = member(suite, key);
  Json expected;
  if (!written.is_null()) {
    T read{};
    JsonFlaws flaws;
    JsonForm<T>::read({}, written, read, flaws);
    if (flaws.any()) found.push_back(in_quotes(key) + " of the suite: " + flaws.text());
    expected = json_of(read);
  }
  if (const Json is = json_of(stated); expected != is)
    found.push_back(in_quotes(key) + " is " + written.dump() + " in the suite and " + is.dump() + " in the manifest");
}

std::vector<std::string> names_of(const auto& entries) {
  std::vector<std::string> names;
  for (const PluginEntry& entry : entries) names.push_back(entry.name);
  return names;
}

// An entry of the suite may stand for several methods, and a merged folder has those of several suites.
void check_lists(std::vector<std::string>& found, const Json& suite, const Manifest& manifest) {
  const auto added = std::count_if(manifest.algorithms.begin(), manifest.algorithms.end(),
                                   [](const ManifestMethod& method) { return method.added; });
  const std::pair<const char*, std::size_t> lists[] = {
      {"scenes", manifest.scenes.size()},
      {"noise_levels", manifest.noise_levels.size()},
      {"algorithms", manifest.algorithms.size() - static_cast<std::size_t>(added)}};
  for (const auto& [key, listed] : lists) {
    const std::size_t in_suite = list_of(suite, key).size();
    if (in_suite > 0 && (std::string_view(key) == "algorithms" ? listed < in_suite : listed != in_suite))
      found.push_back("the suite has " + std::to_string(in_suite) + " " + in_quotes(key) + ", the manifest " +
                      std::to_string(listed));
  }
}

// The suite's plan is in the manifest with defaults filled in; a merged folder has that of its first suite.
void check_analysis(std::vector<std::string>& found, const Json& suite, const Manifest& manifest) {
  const Json& written = object_of(suite, "analysis");
  if (written.empty() == manifest.analysis.has_value()) {
    found.push_back(written.empty() ? "the manifest has an analysis plan, the suite has none"
                                    : "the suite has an analysis plan, the manifest has none");
    return;
  }
  if (!manifest.analysis) return;
  const Json plan = json_of(*manifest.analysis);
  for (const auto& [key, value] : written.items())
    if (member(plan, key.c_str()) != value)
      found.push_back(in_quotes(key) + " of the analysis plan is " + value.dump() + " in the suite and " +
                      member(plan, key.c_str()).dump() + " in the manifest");
  if (manifest.analysis_hash != sha256_hex(canonical_json(plan)))
    found.push_back("'analysis_hash' is not the SHA-256 of the analysis plan");
}

// Readers take the first or the last of two.
void check_names(std::vector<std::string>& found, const Manifest& manifest) {
  const auto check = [&found](const char* key, const auto& entries) {
    std::set<std::string> keys;
    for (const auto& entry : entries) {
      if (!keys.insert(entry.key()).second)
        found.push_back(in_quotes(key) + " has " + in_quotes(entry.name) + " twice");
      if (const std::string mistake = letters_mistake(entry.name); !mistake.empty())
        found.push_back("the name " + in_quotes(entry.name) + " in " + in_quotes(key) + ": " + mistake);
    }
  };
  check("scenes", manifest.scenes);
  check("noise_levels", manifest.noise_levels);
  check("algorithms", manifest.algorithms);
}

void check_order(std::vector<std::string>& found, const Manifest& manifest) {
  const std::vector<std::string>& order = manifest.order;
  const std::size_t different = std::set<std::string>(order.begin(), order.end()).size();
  if (different != order.size()) found.push_back("'order' repeats " + counted(order.size() - different, "trial"));
  if (order.size() != manifest.trials)
    found.push_back("'trials' is " + std::to_string(manifest.trials) + ", but 'order' has " +
                    std::to_string(order.size()));
}

}  // namespace

void refuse_contradictions(const std::vector<std::string>& found, const std::filesystem::path& folder) {
  if (found.empty()) return;
  throw Error(ErrorKind::bad_input, "'" + (folder / "manifest.json").string() +
                                        "' contradicts its suite, so that these results cannot be trusted:\n  " +
                                        join(found, "\n  "));
}

void require_consistent(const Manifest& manifest, const std::filesystem::path& folder) {
  std::vector<std::string> found;
  const std::vector<Json> suites = suites_of(found, manifest);
  for (const Json& suite : suites) {
    check_commitment(found, suite, manifest.commitment);
    check_entries(found, suite);
    check_lists(found, suite, manifest);
    check_places(found, suite, "scenes", names_of(manifest.scenes));
    check_places(found, suite, "noise_levels", names_of(manifest.noise_levels));
    check_number(found, suite, "instances", manifest.instances, kDefaultInstances);
    check_number(found, suite, "first_instance", manifest.first_instance, kDefaultFirstInstance);
    if (!is_suite(suite)) continue;
    check_member(found, suite, "limits", manifest.limits, kDefaultLimits);
    check_member(found, suite, "machine_time", json_of(manifest.machine_time), Json::object());
    check_stated(found, suite, "cycle", manifest.cycle);
    check_stated(found, suite, "cost", manifest.cost);
  }
  if (!suites.empty()) {  // others may differ in these
    const Json& first = suites.front();
    check_number(found, first, "seed", manifest.seed, kDefaultSeed);
    check_analysis(found, first, manifest);
    check_member(found, first, "spec", manifest.spec, nullptr);
    if (is_suite(first)) check_member(found, first, "targets", manifest.targets, Json::array());
    if (is_suite(first)) check_suite_name(found, first, manifest);
  }
  check_methods(found, suites, manifest);
  check_oracles(found, manifest);
  check_secret(found, manifest);
  check_names(found, manifest);
  check_order(found, manifest);
  refuse_contradictions(found, folder);
}

}  // namespace relign::records
