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

std::vector<std::string> texts_of(const Json& manifest) {
  std::vector<std::string> texts;
  for (const Json& suite : list_of(manifest, "suites")) texts.push_back(text_of(suite, "text"));
  if (texts.empty()) texts.push_back(text_of(manifest, "suite"));
  return texts;
}

bool is_suite(const Json& suite) {
  return std::none_of(std::begin(kLists), std::end(kLists),
                      [&](const char* key) { return list_of(suite, key).empty(); });
}

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
std::vector<Json> suites_of(std::vector<std::string>& found, const Json& manifest) {
  std::vector<Json> suites;
  for (const std::string& text : texts_of(manifest)) {
    suites.push_back(text.empty() ? Json::object() : parsed_json(text));
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

void check_secret(std::vector<std::string>& found, const Json& manifest, const std::string& commitment) {
  if (!manifest.contains("secret")) return;
  if (commitment.empty()) {
    found.push_back("there is a 'secret', but no commitment");
  } else if (const std::string own = commitment_to(text_of(manifest, "secret")); own != commitment) {
    found.push_back("'secret' has the commitment " + in_quotes(own) + ", but 'commitment' is " + in_quotes(commitment));
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
  return use;
}

void check_places(std::vector<std::string>& found, const Json& suite, const Json& manifest, const char* key) {
  if (!manifest.contains(key) || list_of(suite, key).empty()) return;
  std::set<std::string> in_suite, in_manifest;
  bool all_known = true;
  for (const Json& entry : list_of(manifest, key)) in_manifest.insert(normalised_name(entry_name(entry)));
  for (const Json& entry : list_of(suite, key)) {
    const std::optional<std::string> name = name_in_suite(entry);
    all_known = all_known && name;
    if (!name) continue;
    in_suite.insert(normalised_name(*name));
    if (!in_manifest.count(normalised_name(*name)))
      found.push_back("the suite has " + in_quotes(*name) + " in " + in_quotes(key) + ", the manifest does not");
  }
  for (const Json& entry : list_of(manifest, key))
    if (all_known && !in_suite.count(normalised_name(entry_name(entry))))
      found.push_back("the manifest has " + in_quotes(entry_name(entry)) + " in " + in_quotes(key) +
                      ", the suite does not");
}

std::vector<std::string> protocols_of(const Json& entry, const std::vector<std::string>& usual) {
  std::vector<std::string> protocols;
  for (const Json& one : list_of(entry, "protocols"))
    protocols.push_back(one.is_string() ? one.get<std::string>() : "");
  if (protocols.empty() && member(entry, "protocol").is_string()) protocols.push_back(text_of(entry, "protocol"));
  return protocols.empty() ? usual : protocols;
}

// Of a method with several trainings: its name in the suite.
std::string list_name(const Json& method) { return text_of(object_of(method, "of_list"), "method"); }

std::string method_text(const std::string& name, const std::string& protocol) {
  return in_quotes(name) + " (protocol " + protocol + ")";
}

// The methods of the manifest against those of all its suites, whose entries have defaults.
void check_methods(std::vector<std::string>& found, const std::vector<Json>& suites, const Json& manifest) {
  if (list_of(manifest, "algorithms").empty() ||
      !std::all_of(suites.begin(), suites.end(), [](const Json& suite) { return is_suite(suite); }))
    return;
  const Json& methods = list_of(manifest, "algorithms");
  const Json& scenes = list_of(manifest, "scenes");
  const bool station =
      std::any_of(scenes.begin(), scenes.end(), [](const Json& scene) { return flag_of(scene, "owns_stage"); });
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
        for (const Json& method : methods) {
          if ((normalised_name(entry_name(method)) != normalised_name(*name) &&
               normalised_name(list_name(method)) != normalised_name(*name)) ||
              (method.is_object() && method.contains("protocol") && text_of(method, "protocol") != protocol))
            continue;
          listed = true;
          const auto compare = [&](const char* key, const Json& expected) {
            if (const Json& stated = member(method, key); !stated.is_null() && stated != expected)
              found.push_back(in_quotes(key) + " of " + method_text(*name, protocol) + " is " + expected.dump() +
                              " in the suite and " + stated.dump() + " in the manifest");
          };
          const Json &steps = member(entry, "steps"), &usual = member(suite, "steps"), &merit = member(entry, "merit");
          compare("steps", !steps.is_null() ? steps : !usual.is_null() ? usual : Json(kDefaultSteps));
          compare("merit", !merit.is_null() ? merit : Json(protocol == "blind" ? "rmse" : "combined"));
        }
        if (!listed && !station)  // which leaves out methods that need its true start
          found.push_back("the suite has the method " + method_text(*name, protocol) + ", the manifest does not");
      }
    }
  for (const Json& method : methods) {
    const std::string name = entry_name(method), protocol = text_of(method, "protocol");
    if (const Json& list = object_of(method, "of_list");
        all_known && method.is_object() && method.contains("of_list") && method.contains("protocol") &&
        (!planned.count({normalised_name(list_name(method)), protocol}) ||
         name != list_name(method) + " (" + text_of(list, "training") + ")"))
      found.push_back("'of_list' of " + method_text(name, protocol) + " names no training of a method of the suite");
    const bool baseline = std::find(kBaselines.begin(), kBaselines.end(), name) != kBaselines.end();
    if (flag_of(method, "added")) {
      if (!baseline)
        found.push_back("the manifest has the method " + method_text(name, protocol) +
                        " as added by the program, which adds baselines only");
    } else if (all_known && method.is_object() && method.contains("protocol") &&
               !planned.count({normalised_name(name), protocol}) &&
               !planned.count({normalised_name(list_name(method)), protocol})) {
      found.push_back("the manifest has the method " + method_text(name, protocol) + ", the suite does not");
    }
  }
}

// What needs no suite: whether a method is ranked, and in which class.
void check_oracles(std::vector<std::string>& found, const Json& manifest) {
  for (const Json& method : list_of(manifest, "algorithms")) {
    if (!flag_of(method, "oracle")) continue;
    const Json& observes = list_of(method, "observes");
    const std::string name = method_text(text_of(method, "name"), text_of(method, "protocol"));
    if (text_of(method, "protocol") == "paper")
      found.push_back(name + " is marked as an oracle, but this protocol gives the true start to every method");
    else if (method.contains("observes") && std::find(observes.begin(), observes.end(), "start") == observes.end())
      found.push_back(name + " is marked as an oracle, but does not observe the true start");
  }
}

void check_suite_name(std::vector<std::string>& found, const Json& suite, const Json& manifest) {
  if (!manifest.contains("suite_name") || !is_suite(suite)) return;
  std::string own = text_of(suite, "name");
  if (own.empty()) own = std::filesystem::path(text_of(manifest, "suite_file")).stem().string();
  if (!own.empty() && own != text_of(manifest, "suite_name"))
    found.push_back("'suite_name' is " + in_quotes(text_of(manifest, "suite_name")) + ", but the suite is called " +
                    in_quotes(own));
}

// Keys that are in both as the suite has them; `usual` is what a suite without the key has.
void check_member(std::vector<std::string>& found, const Json& suite, const Json& manifest, const char* key,
                  const Json& usual) {
  const Json &written = member(suite, key), &stated = member(manifest, key);
  const Json &expected = written.is_null() ? usual : written, &is = stated.is_null() ? usual : stated;
  if (expected != is)
    found.push_back(in_quotes(key) + " is " + expected.dump() + " in the suite and " + is.dump() + " in the manifest");
}

// A folder without its suite has nothing to compare with.
void check_number(std::vector<std::string>& found, const Json& suite, const Json& manifest, const char* key,
                  unsigned usual) {
  if (suite.contains(key) || is_suite(suite)) check_member(found, suite, manifest, key, usual);
}

void check_lists(std::vector<std::string>& found, const Json& suite, const Json& manifest) {
  for (const char* key : kLists) {
    const Json& here = list_of(manifest, key);
    const auto listed = static_cast<std::size_t>(
        std::count_if(here.begin(), here.end(), [](const Json& entry) { return !flag_of(entry, "added"); }));
    // An entry of the suite may stand for several methods, and a merged folder has those of several suites.
    const std::size_t in_suite = list_of(suite, key).size();
    if (!manifest.contains(key) || in_suite == 0) continue;
    if (std::string_view(key) == "algorithms" ? listed < in_suite : listed != in_suite)
      found.push_back("the suite has " + std::to_string(in_suite) + " " + in_quotes(key) + ", the manifest " +
                      std::to_string(listed));
  }
}

// The suite's plan is in the manifest with defaults filled in; a merged folder has that of its first suite.
void check_analysis(std::vector<std::string>& found, const Json& suite, const Json& manifest) {
  const Json &written = object_of(suite, "analysis"), &plan = object_of(manifest, "analysis");
  if (written.empty() != plan.empty()) {
    found.push_back(plan.empty() ? "the suite has an analysis plan, the manifest has none"
                                 : "the manifest has an analysis plan, the suite has none");
    return;
  }
  for (const auto& [key, value] : written.items())
    if (member(plan, key.c_str()) != value)
      found.push_back(in_quotes(key) + " of the analysis plan is " + value.dump() + " in the suite and " +
                      member(plan, key.c_str()).dump() + " in the manifest");
  if (!plan.empty() && text_of(manifest, "analysis_hash") != sha256_hex(canonical_json(plan)))
    found.push_back("'analysis_hash' is not the SHA-256 of the analysis plan");
}

// Readers take the first or the last of two.
void check_names(std::vector<std::string>& found, const Json& manifest) {
  for (const char* key : kLists) {
    std::set<std::string> names;
    for (const Json& entry : list_of(manifest, key))
      if (entry.is_object() && !names.insert(text_of(entry, "name") + "\n" + text_of(entry, "protocol")).second)
        found.push_back(in_quotes(key) + " has " + in_quotes(text_of(entry, "name")) + " twice");
    for (const Json& entry : list_of(manifest, key))
      if (const std::string mistake = letters_mistake(entry_name(entry)); !mistake.empty())
        found.push_back("the name " + in_quotes(entry_name(entry)) + " in " + in_quotes(key) + ": " + mistake);
  }
}

void check_order(std::vector<std::string>& found, const Json& manifest) {
  if (!manifest.contains("order") || !manifest.contains("trials")) return;
  const Json& order = list_of(manifest, "order");
  const std::set<std::string> ids = ordered_ids(manifest);
  if (ids.size() != order.size()) found.push_back("'order' repeats " + counted(order.size() - ids.size(), "trial"));
  if (order.size() != count_of(manifest, "trials"))
    found.push_back("'trials' is " + std::to_string(count_of(manifest, "trials")) + ", but 'order' has " +
                    std::to_string(order.size()));
}

}  // namespace

void refuse_contradictions(const std::vector<std::string>& found, const std::filesystem::path& folder) {
  if (found.empty()) return;
  throw Error(ErrorKind::bad_input, "'" + (folder / "manifest.json").string() +
                                        "' contradicts its suite, so that these results cannot be trusted:\n  " +
                                        join(found, "\n  "));
}

std::string entry_name(const Json& entry) {
  return entry.is_string() ? entry.get<std::string>() : text_of(entry, "name");
}

std::set<std::string> ordered_ids(const Json& manifest) {
  std::set<std::string> ids;
  for (const Json& id : list_of(manifest, "order"))
    if (id.is_string()) ids.insert(id.get<std::string>());
  return ids;
}

bool ran_in_sandbox(const Json& manifest) {
  const Json& sources = list_of(manifest, "sources");
  return manifest.contains("sandbox") ||
         std::any_of(sources.begin(), sources.end(), [](const Json& source) { return source.contains("sandbox"); });
}

std::vector<Json> builds_of(const Json& manifest) {
  const Json& sources = list_of(manifest, "sources");
  std::vector<Json> builds;
  std::set<std::string> hashes;
  const auto add = [&](const Json& program) {
    if (hashes.insert(text_of(program, "hash")).second) builds.push_back(program);
  };
  const auto add_all = [&add](const Json& source) {
    add(member(source, "program"));
    for (const Json& program : list_of(source, "earlier_programs")) add(program);
  };
  if (sources.empty()) add_all(manifest);
  for (const Json& source : sources) add_all(source);
  return builds;
}

std::string builds_note(const Json& manifest) {
  const std::size_t builds = builds_of(manifest).size();
  return builds > 1 ? "results from " + std::to_string(builds) + " builds of relign-bench" : "";
}

bool has_suites(const Json& manifest) {
  const std::vector<std::string> texts = texts_of(manifest);
  return std::all_of(texts.begin(), texts.end(), [](const std::string& text) { return is_suite(parsed_json(text)); });
}

void require_consistent(const Json& manifest, const std::filesystem::path& folder) {
  std::vector<std::string> found;
  const std::string commitment = text_of(manifest, "commitment");
  const std::vector<Json> suites = suites_of(found, manifest);
  for (const Json& suite : suites) {
    check_commitment(found, suite, commitment);
    check_number(found, suite, manifest, "instances", kDefaultInstances);
    check_number(found, suite, manifest, "first_instance", kDefaultFirstInstance);
    check_entries(found, suite);
    check_lists(found, suite, manifest);
    for (const char* key : {"scenes", "noise_levels"}) check_places(found, suite, manifest, key);
    if (!is_suite(suite)) continue;
    check_member(found, suite, manifest, "limits", kDefaultLimits);
    check_member(found, suite, manifest, "machine_time", Json::object());
    for (const char* key : {"cycle", "cost"}) check_member(found, suite, manifest, key, nullptr);
  }
  if (!suites.empty()) {  // others may differ in these
    check_number(found, suites.front(), manifest, "seed", kDefaultSeed);
    check_analysis(found, suites.front(), manifest);
    if (manifest.contains("spec") || is_suite(suites.front()))
      check_member(found, suites.front(), manifest, "spec", nullptr);
    if (is_suite(suites.front())) check_member(found, suites.front(), manifest, "targets", Json::array());
    check_suite_name(found, suites.front(), manifest);
  }
  check_methods(found, suites, manifest);
  check_oracles(found, manifest);
  check_secret(found, manifest, commitment);
  check_names(found, manifest);
  check_order(found, manifest);
  refuse_contradictions(found, folder);
}

}  // namespace relign::records
