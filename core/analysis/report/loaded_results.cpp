#include "report/loaded_results.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/own_command.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

// Removes the list of planned trials from the manifest and returns it, sorted.
std::vector<std::string> take_order(records::Manifest& manifest) {
  std::vector<std::string> planned = std::exchange(manifest.order, {});
  std::sort(planned.begin(), planned.end());
  planned.erase(std::unique(planned.begin(), planned.end()), planned.end());
  return planned;
}

statistics::ScoresByScene scores_of(const records::Manifest& manifest) {
  statistics::ScoresByScene scores;
  for (const records::ManifestScene& scene : manifest.scenes) scores.emplace(scene.name, scene.score);
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
  results.manifest = records::manifest_of(folder);
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
