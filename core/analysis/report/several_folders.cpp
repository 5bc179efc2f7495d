#include "report/several_folders.h"

#include <stdlib.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/error.h"
#include "base/json_members.h"
#include "records/results_folder.h"
#include "report/page_groups.h"
#include "report/rules_data.h"
#include "report/verdict.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

std::string name_of(const fs::path& folder) {
  const fs::path plain = folder.lexically_normal();
  return (plain.has_filename() ? plain.filename() : plain.parent_path().filename()).string();
}

std::string scene_of_set(const std::string& scene, const std::string& label) { return label + ": " + scene; }

void rename_scene(Json& object, const std::string& label) {
  if (object.is_object() && object.contains("scene")) object["scene"] = scene_of_set(text_of(object, "scene"), label);
}

void add_missing(Json& all, const Json& more) {
  for (const Json& value : more)
    if (std::find(all.begin(), all.end(), value) == all.end()) all.push_back(value);
}

class Join {
 public:
  void add(const FolderSet& set, Json data) {
    if (all_.is_null()) {
      all_ = data;
      for (const char* key : {"groups", "failures", "warnings", "gates", "methods", "scene_facts", "training", "scenes",
                              "parts", "aggregate"})
        all_[key] = Json::array();
      for (const char* key : {"command", "suite_file", "suite_text", "seed", "instance_set", "sources", "merge",
                              "merge_notes", "suite_name", "analysis", "analysis_notes", "rules_note"})
        all_.erase(key);
      all_["ran"] = {
          {"planned", 0u},         {"finished", 0u}, {"failed", 0u}, {"missing", 0u}, {"incomplete", Json::array()},
          {"from_other_plans", 0u}};
    }
    for (const char* key : {"spec", "spec_text"})  // groups have their own specification
      if (all_.contains(key) && (!data.contains(key) || data[key] != all_[key])) all_.erase(key);
    // Verdicts were decided with the ratio of their folder's plan; the page shows one ratio for all.
    if (data["smallest_relevant_ratio"] != all_["smallest_relevant_ratio"])
      throw Error(ErrorKind::bad_input, "the analysis plans of '" + text_of(all_["parts"][0], "label") + "' and '" +
                                            set.label + "' have different smallest relevant ratios, " +
                                            all_["smallest_relevant_ratio"].dump() + " and " +
                                            data["smallest_relevant_ratio"].dump() + "; make a page for each folder");
    const std::size_t first_group = all_["groups"].size();
    add_part(set, data);
    add_counts(data);
    add_methods(set, data);
    for (Json group : data["groups"]) {
      rename_scene(group, set.label);
      group["label"] = set.label + ": " + text_of(group, "label");
      all_["groups"].push_back(std::move(group));
    }
    for (Json failure : data["failures"]) {
      for (Json& trial : failure["trials"]) rename_scene(trial, set.label);
      all_["failures"].push_back(std::move(failure));
    }
    for (Json entry : list_of(data, "aggregate")) {
      for (Json& stratum : entry["strata"]) rename_scene(stratum, set.label);
      entry["label"] = set.label;
      all_["aggregate"].push_back(std::move(entry));
    }
    for (const Json& warning : data["warnings"]) all_["warnings"].push_back(warning);
    if (const std::string note = computing_time_note(data); !note.empty())
      time_notes_.push_back(set.label + ": " + note);
    for (Json gate : list_of(data, "gates")) {
      if (!flag_of(gate, "ok")) gate["text"] = set.label + ": " + text_of(gate, "text");
      all_["gates"].push_back(std::move(gate));
    }
    for (Json facts : list_of(data, "scene_facts")) {
      rename_scene(facts, set.label);
      all_["scene_facts"].push_back(std::move(facts));
    }
    add_training(set, data, first_group);
  }

  Json take() {
    std::vector<std::string> names;
    for (const Json& part : all_["parts"])
      if (const std::string name = text_of(part, "suite_name");
          !name.empty() && std::find(names.begin(), names.end(), name) == names.end())
        names.push_back(name);
    std::string title;
    for (const std::string& name : names) title += (title.empty() ? "" : ", ") + name;
    all_["suite_name"] = title;
    label_methods(all_["methods"]);
    if (std::string note = rules_note(all_); !note.empty()) all_["rules_note"] = std::move(note);
    all_["verdict"] = verdict(all_);
    all_["caveats"] = caveats(all_);
    for (std::string& note : time_notes_) all_["caveats"].push_back(std::move(note));
    return std::move(all_);
  }

 private:
  void add_part(const FolderSet& set, const Json& data) {
    Json part = {{"label", set.label}};
    for (const char* key : {"command", "suite_name", "suite_file", "suite_text", "seed", "instance_set", "program",
                            "machine", "sources", "merge", "merge_notes", "analysis", "analysis_notes"})
      if (data.contains(key)) part[key] = data[key];
    all_["parts"].push_back(std::move(part));
  }

  void add_counts(const Json& data) {
    Json& ran = all_["ran"];
    for (const char* key : {"planned", "finished", "failed", "missing", "from_other_plans"})
      ran[key] = count_of(ran, key) + count_of(data["ran"], key);
    for (const Json& trial : list_of(data["ran"], "incomplete")) ran["incomplete"].push_back(trial);
    add_missing(all_["noise_levels"], data["noise_levels"]);
    add_missing(all_["protocols"], data["protocols"]);
    const std::string& label = text_of(all_["parts"].back(), "label");
    for (const Json& scene : data["scenes"]) all_["scenes"].push_back(scene_of_set(scene.get<std::string>(), label));
    all_["instances"] = std::max(count_of(all_, "instances"), count_of(data, "instances"));
    if (data["steps"].empty()) return;
    if (all_["steps"].empty()) all_["steps"] = data["steps"];
    all_["steps"][0] = std::min(all_["steps"][0], data["steps"][0]);
    all_["steps"][1] = std::max(all_["steps"][1], data["steps"][1]);
  }

  // On a page a name under a protocol is one method, with one colour and one row in the table of methods.
  void add_methods(const FolderSet& set, const Json& data) {
    for (const Json& method : data["methods"]) {
      const std::string name = text_of(method, "name");
      const std::string protocol = text_of(method, "protocol");
      const auto [known, is_new] = methods_.try_emplace({name, protocol}, Known{method, set.label});
      if (is_new) {
        all_["methods"].push_back(method);
        continue;
      }
      std::string what;
      if (text_of(method, "id") != text_of(known->second.method, "id")) what = "algorithm";
      if (what.empty() && method["parameters"] != known->second.method["parameters"]) what = "parameters";
      if (what.empty() && text_of(method, "merit") != text_of(known->second.method, "merit")) what = "merit";
      if (!what.empty())
        throw Error(ErrorKind::bad_input,
                    "method '" + name + "' differs between '" + known->second.label + "' and '" + set.label +
                        "' in its " + what +
                        "; give one of them another 'name' in its suite and run it again, or make "
                        "a page for each folder");
    }
  }

  void add_training(const FolderSet& set, const Json& data, std::size_t first_group) {
    for (Json entry : list_of(data, "training")) {
      for (Json& group : entry["pays_after"]) {
        group["group"] = group["group"].get<std::size_t>() + first_group;
        group["label"] = set.label + ": " + text_of(group, "label");
      }
      Json& list = all_["training"];
      const auto same = std::find_if(list.begin(), list.end(), [&entry](const Json& other) {
        return text_of(other, "method") == text_of(entry, "method");
      });
      if (same == list.end()) {
        list.push_back(std::move(entry));
        continue;
      }
      for (Json& group : entry["pays_after"]) (*same)["pays_after"].push_back(std::move(group));
    }
  }

  struct Known {
    Json method;
    std::string label;
  };
  Json all_;
  std::map<std::pair<std::string, std::string>, Known> methods_;  // by name and protocol
  std::vector<std::string> time_notes_;
};

}  // namespace

std::vector<FolderSet> folder_sets(const std::vector<fs::path>& folders) {
  std::vector<FolderSet> sets;
  std::vector<std::string> ids;
  std::set<fs::path> seen;
  for (const fs::path& folder : folders) {
    std::error_code code;
    const fs::path real = fs::weakly_canonical(folder, code);
    if (!code && !seen.insert(real).second) continue;
    std::string id;
    if (fs::exists(folder / "manifest.json", code)) id = text_of(records::read_manifest(folder), "instance_set");
    const auto known = id.empty() ? ids.end() : std::find(ids.begin(), ids.end(), id);
    if (known == ids.end()) {
      ids.push_back(id);
      sets.push_back({"", {folder}});
    } else {
      sets[static_cast<std::size_t>(known - ids.begin())].folders.push_back(folder);
    }
  }
  std::map<std::string, int> uses;
  for (const FolderSet& set : sets) ++uses[name_of(set.folders.front())];
  for (FolderSet& set : sets) {
    const fs::path& first = set.folders.front();
    set.label = uses[name_of(first)] > 1 || name_of(first).empty() ? first.string() : name_of(first);
    if (set.folders.size() > 1) set.label += " and " + std::to_string(set.folders.size() - 1) + " more";
  }
  return sets;
}

TemporaryFolder::TemporaryFolder() {
  std::error_code code;
  std::string pattern = (fs::temp_directory_path(code) / "relign-report-XXXXXX").string();
  if (code || !::mkdtemp(pattern.data()))
    throw Error(ErrorKind::io, "cannot create the temporary folder '" + pattern +
                                   "' for merging the results; set TMPDIR to another place");
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Json joined_data(const std::vector<FolderSet>& sets, std::vector<Json> data) {
  Join join;
  for (std::size_t set = 0; set < sets.size(); ++set) join.add(sets[set], std::move(data[set]));
  return join.take();
}

void add_gallery(Gallery& all, Gallery one, const std::string& label) {
  const std::size_t offset = all.pictures.size();
  const auto shift = [offset](std::optional<std::size_t>& picture) {
    if (picture) *picture += offset;
  };
  for (Picture& picture : one.pictures) all.pictures.push_back(std::move(picture));
  for (TrialPictures& trial : one.trials) {
    shift(trial.start.picture);
    shift(trial.end.picture);
    shift(trial.film.picture);
    trial.scene = scene_of_set(trial.scene, label);
    all.trials.push_back(std::move(trial));
  }
  for (auto& [scene, frame] : one.references) {
    shift(frame.picture);
    all.references[scene_of_set(scene, label)] = std::move(frame);
  }
  for (auto& [scene, axes] : one.axes) all.axes[scene_of_set(scene, label)] = std::move(axes);
  for (auto& [scene, drawing] : one.drawings) all.drawings[scene_of_set(scene, label)] = std::move(drawing);
  all.left_out += one.left_out;
  for (const std::string& problem : one.problems) all.problems.push_back(label + ": " + problem);
}

}  // namespace relign::report
