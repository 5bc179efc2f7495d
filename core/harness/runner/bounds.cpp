#include "runner/bounds.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/seeds.h"
#include "records/record.h"
#include "runner/kept_result.h"
#include "runner/trial_runner.h"
#include "trials/next_image.h"

namespace relign::runner {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxInstances = 2;  // bounds of instances differ by a tenth, and each takes half a second
constexpr std::size_t kPixelsOfAll = 400'000;

std::size_t lenses_of(const trials::SceneFacts& facts) {
  return std::clamp<std::size_t>(kPixelsOfAll / (std::size_t{facts.image_width} * facts.image_height), 1,
                                 kMaxInstances);
}

// One trial of each of the first instances, of any algorithm.
std::map<std::uint64_t, const suites::PlannedTrial*> first_instances(const PreparedPlan& prepared, std::size_t scene,
                                                                     std::size_t level) {
  std::map<std::uint64_t, const suites::PlannedTrial*> lenses;
  for (const suites::PlannedTrial& trial : prepared.plan.trials)
    if (trial.scene == scene && trial.level == level) lenses.emplace(trial.instance, &trial);
  while (lenses.size() > lenses_of(prepared.scenes[scene])) lenses.erase(std::prev(lenses.end()));
  return lenses;
}

// Whether the file exists and is of the same instances: the folder may have been used with another seed, or another
// noise level of the same name.
bool holds(const fs::path& file, const std::string& key) {
  std::error_code code;
  return fs::is_regular_file(file, code) && text_of(parsed_json(read_file(file)), "key") == key;
}

}  // namespace

void write_bounds(const PreparedPlan& prepared, const std::vector<std::size_t>& selected, const fs::path& results,
                  const PictureOptions& options) {
  std::set<std::string> ran;
  for (const std::size_t place : selected) ran.insert(prepared.plan.trials[place].id);
  TrialRunner runner({options.threads, options.cache_folder, {}, options.stop});
  const suites::Suite& suite = prepared.plan.suite;
  for (std::size_t scene = 0; scene < suite.scenes.size(); ++scene) {
    const trials::SceneFacts& facts = prepared.scenes[scene];
    if (facts.owns_stage || !facts.truth) continue;
    for (std::size_t level = 0; level < suite.levels.size(); ++level) {
      const std::string& name = suite.levels[level].name;
      const fs::path file = results / scene_folder(prepared, scene) / "next_image" / (name + ".json");
      const std::string key = short_hash(suite.levels[level].choice.identity + "\n" + suite.seed_json().dump());
      if (holds(file, key)) continue;
      const auto first = first_instances(prepared, scene, level);
      if (first.empty() || !ran.count(first.begin()->second->id)) continue;
      Json known_by = key_of_scene(prepared, scene);
      known_by["level"] = {plugin_host::plugin_hash(*suite.levels[level].choice.plugin),
                           suite.levels[level].choice.identity, suite.seed_json()};
      for (const auto& [instance, trial] : first) known_by["instances"].push_back(instance);
      const KeptResult kept(options.cache_folder, "next_image", std::move(known_by));
      Json lenses = kept.read();
      const bool is_new = lenses.is_null();
      if (is_new) lenses = Json::array();
      try {
        if (is_new)
          for (const auto& [instance, trial] : first) {
            if (options.stop && options.stop->load()) return;
            const TrialRunner::Placed placed = runner.place(make_job(prepared, *trial));
            const records::OwnOptimum optimum = placed.own_optimum();
            if (optimum.pose.empty()) break;
            const std::optional<double> excess =
                trials::next_image_excess(*placed.assembly, facts, optimum.pose, placed.instance.seed);
            if (!excess) break;
            lenses.push_back({{"instance", instance}, {"own_optimum_mse", optimum.mse}, {"excess_mse", *excess}});
          }
      } catch (const Error& error) {
        if (error.kind() != ErrorKind::plugin_failed) throw;
        if (options.on_message)
          options.on_message("no bound of one more image for " + suite.scenes[scene].name + ", " + name + ": " +
                             error.what());
        continue;
      }
      if (is_new && lenses.size() == first.size()) kept.write(lenses);
      if (!lenses.empty())
        write_file_atomically(
            file,
            Json{{"format", records::kFormat}, {"noise_level", name}, {"key", key}, {"lenses", std::move(lenses)}}.dump(
                1) +
                "\n");
    }
  }
}

}  // namespace relign::runner
