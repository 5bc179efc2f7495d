// relign-bench compare: compares two results folders or two methods, as text and as gates for continuous integration.
#include "base/error.h"
#include "cli/app.h"
#include "report/compare.h"

namespace relign::cli {
namespace {

struct CompareArguments {
  std::string a, b;
  std::string track = "recommended";
  int step = -1;
  double relevant = 0;  // 0: of the analysis plan
  std::string rule;
  std::vector<std::string> gates;
};

int write_comparison(Context& context, const CompareArguments& arguments) {
  report::CompareOptions options;
  if (arguments.relevant > 0) options.smallest_relevant_ratio = arguments.relevant;
  options.rule = statistics::rule_named(arguments.rule);
  options.step = arguments.step;
  options.track = report::parse_track(arguments.track);
  for (const std::string& gate : arguments.gates) options.gates.push_back(report::parse_gate(gate));
  const report::ComparedSide a = report::compared_side(arguments.a), b = report::compared_side(arguments.b);
  const report::Comparison result = report::compare(a, b, options);
  print_result(context.json ? to_json(result).dump(2) + "\n" : report::comparison_text(result));
  return result.holds ? kDone : kGateTripped;
}

}  // namespace

void add_compare(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"compare", "Compare two methods on the same instances, with confidence intervals.",
                                  "relign-bench compare results/before results/after --gate 'recommended@20<=1.02x'\n"
                                  "relign-bench compare results/quick:random results/quick:nlopt-bobyqa",
                                  "report, verify"});
  CompareArguments& arguments = add_action(verb, context, write_comparison);
  verb.add_option("A", arguments.a, "baseline: results folder, or FOLDER:METHOD")->required()->type_name("A");
  verb.add_option("B", arguments.b, "candidate, in the same form")->required()->type_name("B");
  verb.add_option("--track", arguments.track,
                  "error to compare; noise-free: recommended (by --rule), commanded, excess, recommended_best or "
                  "recommended_current; measured: best or measured [default: recommended]")
      ->type_name("TRACK:{recommended,commanded,excess,recommended_best,recommended_current,best,measured}");
  add_rule_option(verb, arguments.rule);
  verb.add_option("--step", arguments.step, "step to compare at [default: the last step that both have]")
      ->check(CLI::Range(0, 999999))
      ->type_name("N");
  verb.add_option(
          "--relevant", arguments.relevant,
          "smallest ratio of errors that matters; within it A and B are practically equal [default: the analysis "
          "plan's, else 1.1]")
      ->check(CLI::Range(1.0, 1000.0))
      ->type_name("RATIO");
  verb.add_option(
          "--gate", arguments.gates,
          "condition that must hold, else exit code 4; repeatable. TRACK@STEP<=1.02x: ratio B / A at most 1.02; "
          "TRACK@STEP<=0.01: median of B at most 0.01; yield>=0.95: yield of B at least 0.95; yield>=A-0.02: "
          "yield of B at most 0.02 below that of A")
      ->type_name("GATE");
}

}  // namespace relign::cli
