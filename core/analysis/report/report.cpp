#include "report/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "records/merge.h"
#include "report/aggregate_data.h"
#include "report/cost_text.h"
#include "report/figures.h"
#include "report/loaded_results.h"
#include "report/matrix_data.h"
#include "report/page.h"
#include "report/page_json.h"
#include "report/pictures.h"
#include "report/scene_data.h"
#include "report/several_folders.h"
#include "report/statistics_data.h"
#include "report/text_tables.h"

namespace relign::report {

namespace {

namespace fs = std::filesystem;

// Of several folders: one check of each name.
void add_checks(records::Checks& all, records::Checks more, const std::string& folder) {
  for (records::Check& one : more) {
    const auto known =
        std::find_if(all.begin(), all.end(), [&](const records::Check& other) { return other.name == one.name; });
    for (std::string& finding : one.findings) finding = folder + ": " + finding;
    if (known == all.end()) {
      all.push_back(std::move(one));
      continue;
    }
    for (std::string& finding : one.findings) known->add(std::move(finding));
    known->more += one.more;
    if (known->not_made.empty()) known->not_made = one.not_made;
  }
}

// The results of one instance set.
struct Part {
  Part(const FolderSet& set, std::optional<statistics::Rule> rule, const records::PlanCheck& plan)
      : results(load(set, plan)) {
    study = statistics::make_study(results.trials, study_options(results, rule));
    page = page_model(results, study);
    page.merged_for_this_page = merged != nullptr;
    if (merged) page.provenance.notes = notes;
  }

  LoadedResults load(const FolderSet& set, const records::PlanCheck& plan) {
    if (set.folders.size() == 1) {
      LoadedResults loaded = load_results(set.folders.front(), plan);
      take_findings(set.folders.front(), loaded.checks);
      return loaded;
    }
    // Merging would hide what a folder's own manifest states.
    records::Checks checks;
    for (const fs::path& folder : set.folders) {
      records::Checks own = records::check_folder(folder, plan);
      take_findings(folder, own);
      add_checks(checks, std::move(own), folder.string());
    }
    merged = std::make_unique<TemporaryFolder>();
    records::MergeOptions options;
    options.checked = true;
    options.sources = set.folders;
    options.out = merged->path() / "merged";
    options.on_message = [this](const std::string& note) { notes.push_back(note); };
    records::merge(options);
    LoadedResults loaded = load_results(options.out);
    loaded.checks = std::move(checks);
    return loaded;
  }

  void take_findings(const fs::path& folder, const records::Checks& checks) {
    for (const std::string& finding : records::findings_of(checks))
      findings.push_back(folder.string() + ": " + finding);
  }

  std::unique_ptr<TemporaryFolder> merged;  // kept, since steps are read again from it
  std::vector<std::string> notes, findings;
  LoadedResults results;
  statistics::Study study;
  PageModel page;
};

Gallery gallery_of(const LoadedResults& results, const PageModel& page, std::size_t most_bytes) {
  std::vector<ShownFirst> first;
  for (std::size_t i = 0; i < page.groups.size(); ++i) {
    const Group& group = page.groups[i];
    first.push_back({group.scene, group.noise_level, group.protocol, page.verdict[i].best});
  }
  std::map<std::string, std::string> drawings = scene_drawings(results.folder, results.manifest);
  for (const auto& [scene, uri] : drawings) most_bytes -= std::min(most_bytes, uri.size());
  Gallery gallery = load_gallery(results.folder, most_bytes, first);
  gallery.axes = scene_axes(results.folder, results.manifest);
  gallery.drawings = std::move(drawings);
  return gallery;
}

std::size_t bytes_of(const Gallery& gallery) {
  std::size_t bytes = 0;
  for (const Picture& picture : gallery.pictures) bytes += picture.data_uri.size();
  for (const auto& [scene, uri] : gallery.drawings) bytes += uri.size();
  return bytes;
}

}  // namespace

struct Report::Content {
  Content(const std::vector<fs::path>& folders, std::optional<statistics::Rule> rule, const records::PlanCheck& plan)
      : sets(folder_sets(folders)) {
    for (const FolderSet& set : sets) {
      parts.push_back(std::make_unique<const Part>(set, rule, plan));
      if (const statistics::Rule own = parts.back()->study.rule, first = parts.front()->study.rule; own != first)
        throw Error(ErrorKind::bad_input, "the analysis plans of '" + sets.front().label + "' and '" + set.label +
                                              "' have different rules, '" + statistics::rule_name(first) + "' and '" +
                                              statistics::rule_name(own) +
                                              "'; choose one with --rule own, best or current");
    }
    if (parts.size() == 1) {
      page = parts.front()->page;
      return;
    }
    std::vector<PageModel> pages;
    for (const auto& part : parts) pages.push_back(part->page);
    page = joined_page(sets, std::move(pages));
  }
  std::vector<FolderSet> sets;
  std::vector<std::unique_ptr<const Part>> parts;  // one for each set
  PageModel page;
};

Report::Report(const fs::path& results, std::optional<statistics::Rule> rule, const records::PlanCheck& plan)
    : Report(std::vector<fs::path>{results}, rule, plan) {}
Report::Report(const std::vector<fs::path>& folders, std::optional<statistics::Rule> rule,
               const records::PlanCheck& plan)
    : content_(std::make_unique<const Content>(folders, rule, plan)) {}
Report::~Report() = default;
Report::Report(Report&&) noexcept = default;
Report& Report::operator=(Report&&) noexcept = default;

const PageModel& Report::model() const { return content_->page; }

std::vector<std::string> Report::findings() const {
  std::vector<std::string> all;
  for (const auto& part : content_->parts) all.insert(all.end(), part->findings.begin(), part->findings.end());
  return all;
}

Json Report::json() const { return to_json(content_->page); }

void Report::write_tables() const {
  if (content_->sets.size() != 1 || content_->sets.front().folders.size() != 1)
    throw Error(ErrorKind::internal, "tables can be written for a single results folder only");
  const Part& part = *content_->parts.front();
  const fs::path& folder = part.results.folder;
  std::vector<statistics::Curve> curves;
  for (const statistics::SeriesStudy& series : part.study.series) curves.push_back(series.curve);
  write_file_atomically(folder / "curves.csv", statistics::curves_csv(curves));
  write_file_atomically(folder / "curves.json", statistics::curves_json(curves).dump(1) + "\n");
  write_file_atomically(folder / "aggregate.csv", aggregate_csv(part.page));
  write_file_atomically(folder / "matrix.csv", matrix_csv(part.page));
  if (part.results.manifest.cost) write_file_atomically(folder / "costs.csv", costs_csv(part.page));
  AtomicFile instances(folder / "instances.csv");
  statistics::instances_csv(part.results.trials, [&](std::string_view text) { instances.write(text); });
  instances.commit();
}

std::string Report::html() const {
  Gallery gallery;
  const std::size_t parts = content_->parts.size();
  std::size_t left = kMaxPictureBytes;
  for (std::size_t k = 0; k < parts; ++k) {
    const Part& part = *content_->parts[k];
    Gallery one = gallery_of(part.results, part.page, left / (parts - k));  // unused space is available to the others
    left -= std::min(left, bytes_of(one));
    if (parts == 1)
      gallery = std::move(one);
    else
      add_gallery(gallery, std::move(one), content_->sets[k].label);
  }
  std::set<std::string> shown;
  for (const TrialPictures& trial : gallery.trials) shown.insert(trial.trial);
  FinalErrors rmse;
  for (const auto& part : content_->parts)
    for (const statistics::TrialRow& trial : part->results.trials.rows) {
      if (!trial.counts() || shown.count(trial.trial) == 0) continue;
      const double noise_free = trial.last_of(statistics::Track::recommended);
      rmse[trial.trial] = std::isnan(noise_free) ? trial.last_of(statistics::Track::best) : noise_free;
    }
  return page_html(content_->page, gallery, rmse);
}

void Report::write_html(const fs::path& page) const { write_file_atomically(page, html()); }

std::vector<fs::path> Report::write_figures(const fs::path& folder) const {
  return report::write_figures(content_->page, folder);
}

std::string Report::ranking_table() const { return report::ranking_table(content_->page); }

std::string Report::markdown() const { return markdown_tables(content_->page); }

}  // namespace relign::report
