// relign-bench report: tables and page again, from results folders alone.
#include <filesystem>

#include "base/error.h"
#include "cli/app.h"
#include "report/report.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::vector<std::string> folders;
  std::string out;
};

int write_reports(Context& context, const ReportArguments& arguments) {
  if (!arguments.out.empty() && arguments.folders.size() > 1)
    throw Error(ErrorKind::bad_input, "--out names one page, but " + std::to_string(arguments.folders.size()) +
                                          " results folders are given; leave it out to write a page into each");
  Json pages = Json::array();
  std::string text;
  for (const std::string& folder : arguments.folders) {
    const fs::path page = arguments.out.empty() ? fs::path(folder) / "report.html" : fs::path(arguments.out);
    // The page first: it refuses what is no results folder, before tables are written into it.
    report::write_html_report(folder, page);
    report::write_tables(folder);
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
  verb.add_option("-o,--out", arguments->out, "the page [default: DIR/report.html]")->type_name("FILE");
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return write_reports(context, *arguments); }; });
}

}  // namespace relign::cli
