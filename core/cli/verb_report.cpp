// relign-bench report: tables and page again, from results folders alone.
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "cli/app.h"
#include "report/report.h"
#include "report/text_tables.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kReportFormat = 1;  // of the JSON document; results/README.md has its shape

struct ReportArguments {
  std::vector<std::string> folders;
  std::string out;
  std::string format = "html";
  std::string figures;
  std::string rule;
};

constexpr const char* kStandardOutput = "-";

std::optional<statistics::Rule> rule_of(const ReportArguments& arguments) { return statistics::rule_named(arguments.rule); }

// All folders in one text.
std::string exported(const ReportArguments& arguments) {
  if (arguments.format == "html")  // one page of them all
    return report::Report(std::vector<fs::path>(arguments.folders.begin(), arguments.folders.end()), rule_of(arguments))
        .html();
  std::string text = arguments.format == "csv" ? report::ranking_csv_head() : "";
  Json results = Json::array();
  for (const std::string& folder : arguments.folders) {
    const report::Report report(folder, rule_of(arguments));
    if (arguments.format == "md") {
      text += (text.empty() ? "" : "\n") + report.markdown();
    } else if (arguments.format == "csv") {
      text += report::ranking_csv_rows(report.data(), folder);
    } else {
      Json data = report.data();
      data.erase("format");  // the document's own counts
      data["folder"] = folder;
      results.push_back(std::move(data));
    }
  }
  if (arguments.format == "json")
    text = Json{{"format", kReportFormat}, {"results", results}}.dump(1, ' ', false, Json::error_handler_t::replace) +
           "\n";
  return text;
}

// On standard output, or in one file.
int write_text(Context& context, const ReportArguments& arguments) {
  const std::string text = exported(arguments);
  if (arguments.out.empty() || arguments.out == kStandardOutput) {
    const bool wrapped = context.json && arguments.format != "json";
    const std::string member = arguments.format == "md" ? "markdown" : arguments.format;
    print_result(wrapped ? Json{{member, text}}.dump(2) + "\n" : text);
    return kDone;
  }
  write_file_atomically(arguments.out, text);
  print_result(context.json ? Json{{"reports", {arguments.out}}}.dump(2) + "\n" : arguments.out + "\n");
  return kDone;
}

int write_reports(Context& context, const ReportArguments& arguments) {
  if (arguments.format != "html") {
    if (!arguments.figures.empty())
      throw Error(ErrorKind::bad_input,
                  "--figures goes with the page; leave out --format " + arguments.format + ", or call report twice");
    return write_text(context, arguments);
  }
  if (!arguments.figures.empty() && arguments.out.empty() && arguments.folders.size() > 1)
    throw Error(ErrorKind::bad_input,
                "--figures names one folder, but " + std::to_string(arguments.folders.size()) +
                    " results folders are given; add --out PAGE for one page and one set of figures of them all, or "
                    "make the figures of each with a call of its own");
  if (arguments.out == kStandardOutput) {
    if (!arguments.figures.empty())
      throw Error(ErrorKind::bad_input,
                  "--figures goes with a page in a file; name one with --out, or call report twice");
    return write_text(context, arguments);
  }
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
    write(report::Report(std::vector<fs::path>(arguments.folders.begin(), arguments.folders.end()), rule_of(arguments)),
          arguments.out);
  } else {
    for (const std::string& folder : arguments.folders) {
      const report::Report report(folder, rule_of(arguments));
      report.write_tables();
      write(report, fs::path(folder) / "report.html");
    }
  }
  Json result = {{"reports", pages}};
  if (!arguments.figures.empty()) result["figures"] = figures;
  print_result(context.json ? result.dump(2) + "\n" : text);
  return kDone;
}

}  // namespace

void add_report(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"report", "Write the page and the tables of results folders again.",
                                  "relign-bench report results/quick\n"
                                  "relign-bench report results/quick --figures paper\n"
                                  "relign-bench report results/quick results/more --format csv -o ranking.csv\n"
                                  "relign-bench report results/quick --format json | jq '.results[].groups[].rows[]'\n"
                                  "relign-bench report results/mine results/published -o both.html",
                                  "run, merge, compare"});
  auto arguments = std::make_shared<ReportArguments>();
  verb.add_option("DIR", arguments->folders, "results folder, one or more")->required()->type_name("DIR");
  verb.add_option(
          "-o,--out", arguments->out,
          "write this file alone; - is standard output; of several folders one page: those with the same "
          "instance set are compared, others stand apart [default: html: DIR/report.html, and tables beside it; "
          "md, csv, json: standard output]")
      ->type_name("FILE");
  verb.add_option("--format", arguments->format,
                  "html, md (Markdown tables for a README), csv (a row for each method of each scene, noise level and "
                  "protocol) or json (all numbers of the page) [default: html]")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"html", "md", "csv", "json"}));
  verb.add_option("--rule", arguments->rule,
                  "which pose counts as recommended: own (the method's own), best (of its lowest measured error) or "
                  "current (where it stands) [default: the analysis plan's, else own]")
      ->type_name("RULE:{own,best,current}")
      ->check(CLI::IsMember({"own", "best", "current"}));
  verb.add_option("--figures", arguments->figures,
                  "besides, every figure as SVG and its numbers as CSV into this folder, for a paper "
                  "[default: none]")
      ->type_name("FOLDER");
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return write_reports(context, *arguments); }; });
}

}  // namespace relign::cli
