// relign-bench report: tables and page again, from results folders alone.
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "cli/app.h"
#include "report/report.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::vector<std::string> folders;
  std::string out;
  std::string format = "html";
  std::string figures;
};

// On standard output, or in one file.
int write_markdown(Context& context, const ReportArguments& arguments) {
  std::string text;
  for (const std::string& folder : arguments.folders)
    text += (text.empty() ? "" : "\n") + report::Report(folder).markdown();
  if (arguments.out.empty()) {
    print_result(context.json ? Json{{"markdown", text}}.dump(2) + "\n" : text);
    return kDone;
  }
  write_file_atomically(arguments.out, text);
  print_result(context.json ? Json{{"reports", {arguments.out}}}.dump(2) + "\n" : arguments.out + "\n");
  return kDone;
}

int write_reports(Context& context, const ReportArguments& arguments) {
  if (arguments.format == "md") {
    if (!arguments.figures.empty())
      throw Error(ErrorKind::bad_input, "--figures goes with the page; leave out --format md, or call report twice");
    return write_markdown(context, arguments);
  }
  if (!arguments.figures.empty() && arguments.out.empty() && arguments.folders.size() > 1)
    throw Error(ErrorKind::bad_input,
                "--figures names one folder, but " + std::to_string(arguments.folders.size()) +
                    " results folders are given; add --out PAGE for one page and one set of figures of them all, or "
                    "make the figures of each with a call of its own");
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
    write(report::Report(std::vector<fs::path>(arguments.folders.begin(), arguments.folders.end())), arguments.out);
  } else {
    for (const std::string& folder : arguments.folders) {
      const report::Report report(folder);
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
                                  "relign-bench report results/mine results/published -o both.html",
                                  "run, merge, compare"});
  auto arguments = std::make_shared<ReportArguments>();
  verb.add_option("DIR", arguments->folders, "results folder, one or more")->required()->type_name("DIR");
  verb.add_option("-o,--out", arguments->out,
                  "the page alone, elsewhere; of several folders one page: those with the same instance set are "
                  "compared, others stand apart [default: DIR/report.html and tables; md: standard output]")
      ->type_name("FILE");
  verb.add_option("--format", arguments->format, "html or md (Markdown tables for a README) [default: html]")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"html", "md"}));
  verb.add_option("--figures", arguments->figures,
                  "besides, every figure as SVG and its numbers as CSV into this folder, for a paper "
                  "[default: none]")
      ->type_name("FOLDER");
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return write_reports(context, *arguments); }; });
}

}  // namespace relign::cli
