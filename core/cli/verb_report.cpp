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
  if (arguments.format == "md") return write_markdown(context, arguments);
  if (!arguments.out.empty() && arguments.folders.size() > 1)
    throw Error(ErrorKind::bad_input, "--out names one page, but " + std::to_string(arguments.folders.size()) +
                                          " results folders are given; leave it out to write a page into each");
  Json pages = Json::array();
  std::string text;
  for (const std::string& folder : arguments.folders) {
    const fs::path page = arguments.out.empty() ? fs::path(folder) / "report.html" : fs::path(arguments.out);
    const report::Report report(folder);
    report.write_html(page);
    if (arguments.out.empty()) report.write_tables();
    pages.push_back(page.string());
    text += page.string() + "\n";
  }
  print_result(context.json ? Json{{"reports", pages}}.dump(2) + "\n" : text);
  return kDone;
}

}  // namespace

void add_report(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"report", "Write the page and the tables of results folders again.",
                                  "relign-bench report results/quick", "run"});
  auto arguments = std::make_shared<ReportArguments>();
  verb.add_option("DIR", arguments->folders, "results folder, one or more")->required()->type_name("DIR");
  verb.add_option("-o,--out", arguments->out,
                  "the page alone, elsewhere [default: DIR/report.html and tables; md: standard output]")
      ->type_name("FILE");
  verb.add_option("--format", arguments->format, "html or md (Markdown tables for a README) [default: html]")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"html", "md"}));
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return write_reports(context, *arguments); }; });
}

}  // namespace relign::cli
