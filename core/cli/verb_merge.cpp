// relign-bench merge: merges results folders into one.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/plan_check.h"
#include "records/merge.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct MergeArguments {
  std::vector<std::string> folders;
  std::string out;
};

// "3,17,41", truncated after kShown numbers.
std::string numbers_text(const std::vector<unsigned>& numbers) {
  constexpr std::size_t kShown = 50;
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < numbers.size() && i < kShown; ++i) parts.push_back(std::to_string(numbers[i]));
  return join(parts, ",") + (numbers.size() > kShown ? ",..." : "");
}

std::string result_text(const records::MergeSummary& summary, const fs::path& out) {
  std::string text = "merged   " + out.string() + "\ntrials   " + std::to_string(summary.trials);
  if (summary.missing > 0) text += ", and " + std::to_string(summary.missing) + " planned without a result";
  text += "\n";
  if (summary.shards > 0) {
    text += "shards   " + std::to_string(summary.shards - summary.missing_shards->size()) + " of " +
            std::to_string(summary.shards);
    if (!summary.missing_shards->empty()) text += "; missing: " + numbers_text(*summary.missing_shards);
    text += "\n";
  }
  if (summary.duplicates > 0) {
    text += "twice    " + trials_text(summary.duplicates) + ", equal";
    if (summary.within_tolerance > 0)
      text += " (" + std::to_string(summary.within_tolerance) +
              " of them only within 1e-6: from different kinds of processor, and of plugins that are reproducible on "
              "one kind)";
    text += "\n";
  }
  if (!summary.not_compared.empty())
    text += "skipped  " + records::to_string(summary.not_compared) + ": recorded by a build without this column\n";
  if (summary.superseded > 0)
    text += "twice    " + trials_text(summary.superseded) +
            " that ended early in one folder and are complete in another; the complete ones are kept\n";
  return text;
}

void print_disagreements(const records::MergeSummary& summary) {
  constexpr std::size_t kShown = 10;
  for (std::size_t i = 0; i < summary.disagreements.size() && i < kShown; ++i) {
    const records::Disagreement& one = summary.disagreements[i];
    print_warning("not reproducible: trial " + one.trial + " " + one.label + "\n  " +
                  records::to_string(one.difference) + "\n  was: " + one.kept + " (kept)\n  is:  " + one.other);
  }
  if (summary.disagreements.size() > kShown)
    print_warning("... and " + std::to_string(summary.disagreements.size() - kShown) +
                  " more; the merged manifest.json lists them");
}

int run_merge(Context& context, const MergeArguments& arguments) {
  records::MergeOptions options;
  options.sources.assign(arguments.folders.begin(), arguments.folders.end());
  options.out = arguments.out;
  options.command = context.typed_command();
  options.plan = plan_check(context);
  options.on_message = [](const std::string& note) { print_warning(note); };
  const records::MergeSummary summary = records::merge(options);
  print_disagreements(summary);
  if (summary.half_written > 0)
    print_warning(trials_text(summary.half_written) + " are only partly written and are ignored");
  if (summary.left_out > 0)
    print_warning(trials_text(summary.left_out) + " belong to an earlier version of a folder's suite and are ignored");
  if (context.json) {
    Json result = json_of(summary);
    result["merged"] = arguments.out;
    print_result(result.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  } else {
    print_text(result_text(summary, arguments.out));
    std::fprintf(stderr, "Next: %s\n", own_command("report " + shell_quoted(arguments.out)).c_str());
  }
  if (summary.disagreeing == 0) return kDone;
  print_warning(trials_text(summary.disagreeing) + " differ between two folders: they are not reproducible");
  return kGateTripped;
}

}  // namespace

void add_merge(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"merge", "Merge results on the same instances: shards of a plan, or a study and a new method.",
                     "relign-bench merge results/study results/ours -o results/both\n"
                     "relign-bench merge results/quick -o results/quick-all   # all shards in results/quick",
                     "plan, run, report, verify"});
  MergeArguments& arguments = add_action(verb, context, run_merge);
  verb.add_option("DIR", arguments.folders, "one or more results folders or folders of shards")
      ->required()
      ->type_name("DIR");
  verb.add_option("-o,--out", arguments.out, "folder to create; a folder from an earlier merge is replaced")
      ->required()
      ->type_name("DIR");
}

}  // namespace relign::cli
