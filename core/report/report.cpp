#include "report/report.h"

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/files.h"
#include "report/figures.h"
#include "report/loaded_results.h"
#include "report/page.h"
#include "report/page_data.h"
#include "report/pictures.h"
#include "report/statistics_data.h"
#include "report/text_tables.h"

namespace relign::report {

struct Report::Content {
  explicit Content(const std::filesystem::path& folder)
      : results(load_results(folder)),
        study(stats::make_study(results.trials, study_options(results))),
        data(page_data(results, study)) {}
  LoadedResults results;
  stats::Study study;
  Json data;
};

Report::Report(const std::filesystem::path& results) : content_(std::make_unique<const Content>(results)) {}
Report::~Report() = default;
Report::Report(Report&&) noexcept = default;
Report& Report::operator=(Report&&) noexcept = default;

const Json& Report::data() const { return content_->data; }

void Report::write_tables() const {
  const std::filesystem::path& folder = content_->results.folder;
  std::vector<stats::Curve> curves;
  for (const stats::SeriesStudy& series : content_->study.series) curves.push_back(series.curve);
  write_file_atomically(folder / "curves.csv", stats::curves_csv(curves));
  write_file_atomically(folder / "curves.json", stats::curves_json(curves).dump(1) + "\n");
  AtomicFile instances(folder / "instances.csv");
  stats::instances_csv(content_->results.trials, [&](std::string_view text) { instances.write(text); });
  instances.commit();
}

std::string Report::html() const {
  const LoadedResults& results = content_->results;
  Gallery gallery = load_gallery(results.folder);
  gallery.axes = scene_axes(results.folder, results.manifest);
  std::set<std::string> shown;
  for (const TrialPictures& trial : gallery.trials) shown.insert(trial.trial);
  std::map<std::string, double> rmse;
  for (const stats::TrialRow& trial : results.trials.rows) {
    if (trial.steps == 0 || shown.count(trial.trial) == 0) continue;
    const double truth = trial.last_of(stats::Track::recommended);
    rmse[trial.trial] = std::isnan(truth) ? trial.last_of(stats::Track::best) : truth;
  }
  return page(content_->data, gallery, rmse);
}

void Report::write_html(const std::filesystem::path& page) const { write_file_atomically(page, html()); }

std::vector<std::filesystem::path> Report::write_figures(const std::filesystem::path& folder) const {
  return report::write_figures(content_->data, folder);
}

std::string Report::ranking_table() const { return report::ranking_table(content_->data); }

std::string Report::markdown() const { return markdown_tables(content_->data); }

}  // namespace relign::report
