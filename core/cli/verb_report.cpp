// relign-bench report: writes page and tables from results folders alone.
#include <algorithm>
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"
#include "base/own_command.h"
#include "cli/app.h"
#include "cli/browser.h"
#include "cli/plan_check.h"
#include "records/results_folder.h"
#include "report/report.h"
#include "report/text_tables.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kReportFormat = 1;  // of the JSON document, described in results/README.md

struct ReportArguments {
  std::vector<std::string> folders;
  std::string out;
  std::string format = "html";
  std::string figures;
  std::string rule;
  bool open = false;
};

constexpr const char* kStandardOutput = "-";

std::optional<statistics::Rule> rule_of(const ReportArguments& arguments) {
  return statistics::rule_named(arguments.rule);
}

// Makes reports, and warns of failed checks of their folders.
class Reports {
 public:
  Reports(Context& context, const ReportArguments& arguments) : plan_(plan_check(context)), rule_(rule_of(arguments)) {}

  report::Report of(const std::vector<std::string>& folders) {
    report::Report made(std::vector<fs::path>(folders.begin(), folders.end()), rule_, plan_);
    failed_ = warn_of_failed_checks(made) || failed_;
    for (const report::QualityGate& gate : made.model().gates)
      if (!gate.ok && gate.name == "ran") print_warning(gate.text);
    return made;
  }
  int exit_code() const { return failed_ ? kGateTripped : kDone; }

 private:
  records::PlanCheck plan_;
  std::optional<statistics::Rule> rule_;
  bool failed_ = false;
};

// The report of all folders as one text.
std::string exported(Reports& reports, const ReportArguments& arguments) {
  if (arguments.format == "html") return reports.of(arguments.folders).html();  // one page for all folders
  const bool csv = arguments.format == "csv";
  report::MoreColumns more;
  for (const std::string& folder : arguments.folders) {
    if (!csv) break;
    const records::Manifest manifest = records::manifest_of(folder);
    more.cycle = more.cycle || manifest.cycle;
    for (const records::ManifestScene& scene : manifest.scenes) {
      more.score = more.score || !scene.score.squared;
      more.further = std::max(more.further, scene.score.further.size());
    }
  }
  std::string text = csv ? report::ranking_csv_head(more) : "";
  Json results = Json::array();
  for (const std::string& folder : arguments.folders) {
    const report::Report report = reports.of({folder});
    if (arguments.format == "md") {
      text += (text.empty() ? "" : "\n") + report.markdown();
    } else if (csv) {
      text += report::ranking_csv_rows(report.model(), folder, more);
    } else {
      Json data = report.json();
      data.erase("format");  // the document has its own
      data["folder"] = folder;
      results.push_back(std::move(data));
    }
  }
  if (arguments.format == "json")
    text = Json{{"format", kReportFormat}, {"results", results}}.dump(1, ' ', false, Json::error_handler_t::replace) +
           "\n";
  return text;
}

// Writes to standard output or to one file.
int write_text(Context& context, const ReportArguments& arguments) {
  Reports reports(context, arguments);
  const std::string text = exported(reports, arguments);
  if (arguments.out.empty() || arguments.out == kStandardOutput) {
    const bool wrapped = context.json && arguments.format != "json";
    const std::string member = arguments.format == "md" ? "markdown" : arguments.format;
    print_result(wrapped ? Json{{member, text}}.dump(2) + "\n" : text);
    return reports.exit_code();
  }
  write_file_atomically(arguments.out, text);
  print_result(context.json ? Json{{"reports", {arguments.out}}}.dump(2) + "\n" : arguments.out + "\n");
  return reports.exit_code();
}

// The folder in results/ with the latest manifest.
std::string latest_results() {
  fs::path latest;
  fs::file_time_type latest_time = fs::file_time_type::min();
  std::error_code error;
  for (fs::directory_iterator entry("results", error), end; !error && entry != end; entry.increment(error)) {
    std::error_code none;
    const fs::file_time_type time = fs::last_write_time(entry->path() / "manifest.json", none);
    if (none || time <= latest_time) continue;
    latest = entry->path();
    latest_time = time;
  }
  if (latest.empty())
    throw Error(ErrorKind::bad_input,
                "DIR is required: the folder 'results' here has no results; run a suite first: '" +
                    own_command("run quick") + "'");
  return latest.string();
}

int write_reports(Context& context, const ReportArguments& given) {
  ReportArguments arguments = given;
  if (arguments.folders.empty()) arguments.folders = {latest_results()};
  const bool to_file = arguments.format == "html" && arguments.out != kStandardOutput;
  if (arguments.open && !to_file)
    throw Error(ErrorKind::bad_input, "--open: requires a page in a file, found " +
                                          (arguments.format == "html" ? "--out -" : "--format " + arguments.format));
  if (arguments.format != "html") {
    if (!arguments.figures.empty())
      throw Error(ErrorKind::bad_input,
                  "--figures: requires --format html, found '" + arguments.format + "'; run report twice for both");
    return write_text(context, arguments);
  }
  if (!arguments.figures.empty() && arguments.out.empty() && arguments.folders.size() > 1)
    throw Error(ErrorKind::bad_input,
                "--figures: one folder of figures for " + std::to_string(arguments.folders.size()) +
                    " results folders; add --out PAGE for one page and one set of figures of all, or run report for "
                    "each folder");
  if (arguments.out == kStandardOutput) {
    if (!arguments.figures.empty())
      throw Error(ErrorKind::bad_input,
                  "--figures: requires a page in a file, found --out -; choose a file, or run report twice");
    return write_text(context, arguments);
  }
  Reports reports(context, arguments);
  Json pages = Json::array(), figures = Json::array();
  std::string text;
  const auto write = [&](const report::Report& report, const fs::path& page) {
    report.write_html(page);
    pages.push_back(page.string());
    text += page.string() + "\n";
    if (arguments.figures.empty()) return;
    for (const fs::path& file : report.write_figures(arguments.figures)) {
      figures.push_back(file.string());
      text += file.string() + "\n";
    }
  };
  if (!arguments.out.empty()) {
    write(reports.of(arguments.folders), arguments.out);
  } else {
    for (const std::string& folder : arguments.folders) {
      const report::Report report = reports.of({folder});
      report.write_tables();
      write(report, fs::path(folder) / "report.html");
    }
  }
  Json result = {{"reports", pages}};
  if (!arguments.figures.empty()) result["figures"] = figures;
  print_result(context.json ? result.dump(2) + "\n" : text);
  if (arguments.open)
    for (const Json& written : pages)
      if (!open_in_browser(written.get<std::string>())) break;  // and none of the others
  return reports.exit_code();
}

}  // namespace

void add_report(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"report", "Write the report of results folders. Exit code 4 if a check of the records failed.",
                     "relign-bench report --open\n"
                     "relign-bench report results/quick --figures paper\n"
                     "relign-bench report results/quick results/more --format csv -o ranking.csv\n"
                     "relign-bench report results/quick --format json | jq '.results[].groups[].rows[]'\n"
                     "relign-bench report results/mine results/published -o both.html",
                     "run, merge, compare"});
  ReportArguments& arguments = add_action(verb, context, write_reports);
  verb.add_option("DIR", arguments.folders, "one or more results folders [default: the latest in results/]")
      ->type_name("DIR");
  verb.add_option("-o,--out", arguments.out,
                  "write only this file (- for standard output); several folders make one page [default: html: "
                  "DIR/report.html, with tables beside it; md, csv, json: standard output]")
      ->type_name("FILE");
  verb.add_option("--format", arguments.format,
                  "html, md (tables for a README), csv (the ranking) or json "
                  "(all numbers of the page) [default: html]")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"html", "md", "csv", "json"}));
  add_rule_option(verb, arguments.rule);
  verb.add_flag("--open", arguments.open, "open the page in a browser; without a display, print how to copy it");
  verb.add_option("--figures", arguments.figures,
                  "also write every figure as SVG, and its numbers as CSV, to this folder, for a paper [default: none]")
      ->type_name("FOLDER");
}

}  // namespace relign::cli
