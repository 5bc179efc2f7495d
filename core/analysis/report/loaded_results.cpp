#include "report/loaded_results.h"

#include <algorithm>

#include "base/error.h"
#include "base/json_members.h"
#include "base/own_command.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

// Removes the list of planned trials from the manifest and returns it, sorted.
std::vector<std::string> take_order(Json& manifest) {
  std::vector<std::string> planned;
  const auto order = manifest.find("order");
  if (order == manifest.end()) return planned;
  if (order->is_array())
    for (Json& id : *order)
      if (id.is_string()) planned.push_back(std::move(id.get_ref<std::string&>()));
  manifest.erase(order);
  std::sort(planned.begin(), planned.end());
  planned.erase(std::unique(planned.begin(), planned.end()), planned.end());
  return planned;
}

statistics::ScoresByScene scores_of(const Json& manifest) {
  statistics::ScoresByScene scores;
  for (const Json& scene : list_of(manifest, "scenes")) scores.emplace(text_of(scene, "name"), scene_score_of(scene));
  return scores;
}

}  // namespace

LoadedResults load_results(const fs::path& folder, const records::PlanCheck& plan) {
  std::error_code ignored;
  records::require_folder(folder);
  const fs::path manifest_path = folder / "manifest.json";
  if (!fs::exists(manifest_path, ignored))
    throw Error(ErrorKind::bad_input,
                "'" + folder.string() + "' is not a results folder, since it has no manifest.json; create one with '" +
                    own_command("run SUITE -o FOLDER") + "'");

  LoadedResults results;
  results.folder = folder;
  results.manifest = records::read_manifest(folder);
  records::require_consistent(results.manifest, folder);
  records::FolderChecks checks(results.manifest, folder);
  records::Check of_plan = records::made_by(plan, results.manifest);
  const std::vector<std::string> planned = take_order(results.manifest);
  results.planned = planned.size();
  statistics::ReadTable read = statistics::read_trial_table(
      folder,
      [&](const std::string& trial) {
        return planned.empty() || std::binary_search(planned.begin(), planned.end(), trial);
      },
      &checks, scores_of(results.manifest));
  results.trials = std::move(read.table);
  results.incomplete = std::move(read.incomplete);
  results.from_other_plans = read.left_out;
  results.checks = checks.result(std::move(of_plan));
  return results;
}

}  // namespace relign::report
