// The report of a results folder: tables, figures and one self-contained HTML page. Needs nothing but the folder,
// neither plugins nor optics, so that it can be made on another machine.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "records/folder_checks.h"
#include "report/page_model.h"
#include "statistics/rules.h"

namespace relign::report {

class Report {
 public:
  // Reads the folder. `rule`: the recommendation rule; nullopt: as in the analysis plan, else `own`. Throws Error: io
  // if the folder cannot be read; bad_input if it is not a results folder, is damaged or has a newer format, if the
  // records lack the scores of the rule, and if the plans of several folders have different rules. Failed checks are
  // part of the report; `plan` makes one that needs plugins.
  explicit Report(const std::filesystem::path& results, std::optional<statistics::Rule> rule = std::nullopt,
                  const records::PlanCheck& plan = {});
  // One page of several folders: those with the same instance set are merged in a temporary folder, others have groups
  // of their own. Also throws as records::merge, and bad_input if one name denotes different methods.
  explicit Report(const std::vector<std::filesystem::path>& folders,
                  std::optional<statistics::Rule> rule = std::nullopt, const records::PlanCheck& plan = {});
  ~Report();
  Report(Report&&) noexcept;
  Report& operator=(Report&&) noexcept;

  const PageModel& model() const;
  // Of the checks of the folders: "results/mine: steps: trial 4f1c... has ..."
  std::vector<std::string> findings() const;
  Json json() const;  // as `report --format json` writes it (page_json.h)

  // Writes aggregate.csv, curves.csv, curves.json, instances.csv, matrix.csv and, with prices, costs.csv into the
  // results folder. For a single
  // folder only.
  void write_tables() const;

  std::string html() const;
  void write_html(const std::filesystem::path& page) const;

  // Writes every figure as SVG and CSV; creates the folder. Returns the paths. Throws Error (io).
  std::vector<std::filesystem::path> write_figures(const std::filesystem::path& folder) const;

  // Plain-text ranking for the terminal; a single line without results.
  std::string ranking_table() const;

  // The ranking as Markdown: a table per scene and protocol with a column per noise level, best method first.
  std::string markdown() const;

 private:
  struct Content;
  std::unique_ptr<const Content> content_;
};

}  // namespace relign::report
