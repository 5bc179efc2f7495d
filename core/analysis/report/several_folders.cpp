#include "report/several_folders.h"

#include <stdlib.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/error.h"
#include "base/json_members.h"
#include "base/text.h"
#include "records/results_folder.h"
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

template <class Value>
void append(std::vector<Value>& all, std::vector<Value>& more) {
  std::move(more.begin(), more.end(), std::back_inserter(all));
}

void append_missing(std::vector<std::string>& all, const std::vector<std::string>& more) {
  for (const std::string& value : more)
    if (std::find(all.begin(), all.end(), value) == all.end()) all.push_back(value);
}

// The names on a page of several sets: scenes, groups and failed checks begin with the label of their set.
void label_page(PageModel& page, const std::string& label, std::size_t first_group) {
  const auto prefix = [&](std::string& name) { name = label + ": " + name; };
  for (std::string& scene : page.scenes) prefix(scene);
  for (Group& group : page.groups) prefix(group.scene), prefix(group.label);
  for (Failure& failure : page.failures)
    for (FailedTrial& trial : failure.trials) prefix(trial.scene);
  for (Aggregate& aggregate : page.aggregates) {
    aggregate.label = label;
    for (Stratum& stratum : aggregate.strata) prefix(stratum.scene);
  }
  for (SceneFacts& facts : page.scene_facts) prefix(facts.scene);
  for (QualityGate& gate : page.gates)
    if (!gate.ok) prefix(gate.text);
  for (TrainingCost& cost : page.training)
    for (BreakEven& even : cost.pays_after) {
      even.group += first_group;
      prefix(even.label);
    }
}

void add_counts(RunState& all, const RunState& more) {
  all.planned += more.planned;
  all.finished += more.finished;
  all.failed += more.failed;
  all.missing += more.missing;
  all.from_other_plans += more.from_other_plans;
  all.incomplete.insert(all.incomplete.end(), more.incomplete.begin(), more.incomplete.end());
}

// What differs between two methods of one name under one protocol; "" if nothing does.
const char* difference(const Method& a, const Method& b) {
  return a.id != b.id ? "algorithm" : a.parameters != b.parameters ? "parameters" : a.merit != b.merit ? "merit" : "";
}

// On a page a name under a protocol is one method, with one colour and one row in the table of methods.
class JoinedMethods {
 public:
  void add(const std::string& label, const std::vector<Method>& more, std::vector<Method>& all) {
    for (const Method& method : more) {
      const auto [known, is_new] = known_.try_emplace({method.name, method.protocol}, Known{method, label});
      if (is_new) all.push_back(method);
      if (const std::string what = difference(method, known->second.method); !what.empty())
        throw Error(ErrorKind::bad_input,
                    "method '" + method.name + "' differs between '" + known->second.label + "' and '" + label +
                        "' in its " + what +
                        "; give one of them another 'name' in its suite and run it again, or make "
                        "a page for each folder");
    }
  }

 private:
  struct Known {
    Method method;
    std::string label;
  };
  std::map<std::pair<std::string, std::string>, Known> known_;  // by name and protocol
};

void add_training(std::vector<TrainingCost>& all, std::vector<TrainingCost>& more) {
  for (TrainingCost& cost : more) {
    const auto same =
        std::find_if(all.begin(), all.end(), [&](const TrainingCost& other) { return other.method == cost.method; });
    if (same == all.end())
      all.push_back(std::move(cost));
    else
      append(same->pays_after, cost.pays_after);
  }
}

// Verdicts were decided with the ratio of their folder's plan; the page shows one ratio for all.
void check_ratio(const FolderSet& first, double of_first, const FolderSet& set, double of_set) {
  if (of_first == of_set) return;
  throw Error(ErrorKind::bad_input, "the analysis plans of '" + first.label + "' and '" + set.label +
                                        "' have different smallest relevant ratios, " + Json(of_first).dump() +
                                        " and " + Json(of_set).dump() + "; make a page for each folder");
}

}  // namespace

std::vector<FolderSet> folder_sets(const std::vector<fs::path>& folders) {
  std::vector<FolderSet> sets;
  std::vector<std::string> ids;
  std::set<fs::path> seen;
  for (const fs::path& folder : folders) {
    std::error_code code;
    const fs::path real = fs::weakly_canonical(folder, code);
    if (!code && !seen.insert(real).second) continue;
    const std::optional<records::Manifest> manifest = records::read_manifest(folder);
    const std::string id = manifest ? manifest->instance_set : "";
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

PageModel joined_page(const std::vector<FolderSet>& sets, std::vector<PageModel> pages) {
  PageModel all;
  all.rule = pages.front().rule;
  all.smallest_relevant_ratio = pages.front().smallest_relevant_ratio;
  all.spec_text = pages.front().spec_text;
  JoinedMethods methods;
  std::vector<std::string> titles, time_notes;
  for (std::size_t set = 0; set < sets.size(); ++set) {
    const std::string& label = sets[set].label;
    PageModel& page = pages[set];
    check_ratio(sets.front(), all.smallest_relevant_ratio, sets[set], page.smallest_relevant_ratio);
    if (const std::string note = computing_time_note(page.ran); !note.empty())
      time_notes.push_back(label + ": " + note);
    if (page.spec_text != all.spec_text) all.spec_text.clear();
    if (!page.title.empty()) append_missing(titles, {page.title});
    label_page(page, label, all.groups.size());
    add_counts(all.ran, page.ran);
    methods.add(label, page.methods, all.methods);
    append(all.scenes, page.scenes);
    append_missing(all.noise_levels, page.noise_levels);
    append_missing(all.protocols, page.protocols);
    all.instances = std::max(all.instances, page.instances);
    if (page.steps && !all.steps) all.steps = page.steps;
    if (page.steps)
      all.steps = {std::min(all.steps->least, page.steps->least), std::max(all.steps->most, page.steps->most)};
    append(all.groups, page.groups);
    append(all.failures, page.failures);
    append(all.warnings, page.warnings);
    append(all.gates, page.gates);
    all.without_suite = all.without_suite || page.without_suite;
    append(all.aggregates, page.aggregates);
    append(all.scene_facts, page.scene_facts);
    add_training(all.training, page.training);
    all.parts.push_back({label, std::move(page.provenance)});
  }
  all.title = join(titles, ", ");
  label_methods(all.methods);
  all.rules_note = rules_note(all.groups, all.analysis.primary_is_yield);
  all.verdict = verdict(all);
  all.caveats = caveats(all);
  append(all.caveats, time_notes);
  return all;
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
