#include "report/report.h"

#include <cmath>
#include <map>

#include "base/files.h"
#include "report/loaded_results.h"
#include "report/page.h"
#include "report/page_data.h"
#include "report/pictures.h"
#include "stats/curves.h"

namespace relign::report {

void write_tables(const std::filesystem::path& folder) {
  const LoadedResults results = load_results(folder);
  const std::vector<stats::Curve> curves = stats::make_curves(results.trials);
  write_file_atomically(folder / "curves.csv", stats::curves_csv(curves));
  write_file_atomically(folder / "curves.json", stats::curves_json(curves).dump(1) + "\n");
  write_file_atomically(folder / "instances.csv", stats::instances_csv(results.trials));
}

std::string html_report(const std::filesystem::path& folder) {
  const LoadedResults results = load_results(folder);
  std::map<std::string, double> rmse;
  for (const records::TrialRecord& trial : results.trials)
    if (!trial.steps.empty()) {
      const double truth = recommended_rmse(trial);
      rmse[trial.trial] = std::isnan(truth) ? best_measured_rmse(trial) : truth;
    }
  return page(page_data(results), load_gallery(folder), rmse);
}

void write_html_report(const std::filesystem::path& folder, const std::filesystem::path& page_path) {
  write_file_atomically(page_path, html_report(folder));
}

}  // namespace relign::report
