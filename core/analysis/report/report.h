// The report: tables and one self-contained HTML file made from a results folder alone. Knows no optics and
// loads no plugin: a report can be made on another machine.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "statistics/rules.h"

namespace relign::report {

class Report {
 public:
  // Reads the folder, once for everything below. Throws Error: io when nothing can be read, bad_input when the folder
  // holds no results, damaged ones or a newer format.
  // `rule`: which pose counts as recommended; none: the analysis plan's, else `own`. Throws also, bad_input, where the
  // records lack what the rule needs, and where the plans of several folders name different rules.
  explicit Report(const std::filesystem::path& results, std::optional<statistics::Rule> rule = std::nullopt);
  // One page of several folders: those with the same instance set are merged for it, in a temporary folder; others
  // stand in groups of their own. Throws besides what merge refuses, and where one name means two methods.
  explicit Report(const std::vector<std::filesystem::path>& folders,
                  std::optional<statistics::Rule> rule = std::nullopt);
  ~Report();
  Report(Report&&) noexcept;
  Report& operator=(Report&&) noexcept;

  // Everything below in words and numbers, as page_data.h has it.
  const Json& data() const;

  // aggregate.csv, curves.csv, curves.json and instances.csv into the results folder (tables of the same data). Of one
  // folder only.
  void write_tables() const;

  std::string html() const;
  void write_html(const std::filesystem::path& page) const;

  // Every figure as SVG and its numbers as CSV, for a paper; makes the folder. Returns the files. Throws Error(io).
  std::vector<std::filesystem::path> write_figures(const std::filesystem::path& folder) const;

  // Plain-text ranking for the terminal; empty results give a sentence that says so.
  std::string ranking_table() const;

  // The ranking as Markdown: a table per scene and protocol with a column per noise level, best method first.
  std::string markdown() const;

 private:
  struct Content;
  std::unique_ptr<const Content> content_;
};

}  // namespace relign::report
