// relign-bench submit evaluate: runs a submission on a suite, in a sandbox, and joins the results of others.
#include <cstdio>
#include <memory>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/interrupt.h"
#include "cli/plan_check.h"
#include "cli/secrets.h"
#include "cli/shared_files.h"
#include "leaderboard_verbs/submission_run.h"
#include "plugin_host/process_plugin.h"
#include "records/merge.h"
#include "records/results_folder.h"
#include "report/report.h"
#include "runner/provenance.h"
#include "runner/run.h"
#include "submissions/archive.h"
#include "submissions/evaluation_suite.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "relign-bench/evaluation/1";
constexpr const char* kEvaluationFile = "evaluation.json";
constexpr const char* kArchiveHash = "archive.sha256";  // only while the evaluation is incomplete
constexpr const char* kUnpacked = "submission";
constexpr const char* kResults = "results";
constexpr const char* kOwnRun = "run";  // only while the evaluation is incomplete

struct EvaluateArguments {
  std::string archive, suite, out, secret;
  std::vector<std::string> baselines;
  unsigned workers = 0;
};

// The folder of the evaluation. What an error leaves before the first trial is removed; later, the same command
// resumes.
class EvaluationFolder {
 public:
  EvaluationFolder(fs::path folder, std::string archive_hash)
      : path_(std::move(folder)), hash_(std::move(archive_hash)) {
    std::error_code error;
    if (!fs::exists(fs::symlink_status(path_, error))) return;
    resumed_ =
        fs::is_regular_file(path_ / kArchiveHash, error) && read_file(path_ / kArchiveHash, hash_.size()) == hash_;
    kept_ = true;
    if (!resumed_)
      throw Error(ErrorKind::bad_input, "'" + path_.string() +
                                            "' already exists and is not an interrupted evaluation of this archive; "
                                            "choose another folder, or remove it");
  }
  ~EvaluationFolder() {
    std::error_code ignored;
    if (!kept_) fs::remove_all(path_, ignored);
  }
  EvaluationFolder(const EvaluationFolder&) = delete;
  EvaluationFolder& operator=(const EvaluationFolder&) = delete;

  fs::path operator/(const std::string& name) const { return path_ / name; }
  const fs::path& path() const { return path_; }

  // Of an evaluation without baselines that was interrupted after its results were in place.
  void reopen_results() {
    std::error_code error;
    if (resumed_ && !fs::exists(path_ / kOwnRun, error) && fs::exists(path_ / kResults, error))
      fs::rename(path_ / kResults, path_ / kOwnRun);
  }

  void unpack(const fs::path& archive) {
    if (resumed_) return;
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) throw Error(ErrorKind::io, "cannot create '" + path_.string() + "': " + error.message());
    submissions::unpack_archive(archive, path_ / kUnpacked);
  }
  void keep() {
    write_file_atomically(path_ / kArchiveHash, hash_);
    kept_ = true;
  }
  const std::string& archive_hash() const { return hash_; }

 private:
  fs::path path_;
  std::string hash_;
  bool resumed_ = false, kept_ = false;
};

// Other instances could not be merged, and another protocol not ranked; better said before the trials than after.
void refuse_other_baselines(Context& context, const std::vector<std::string>& baselines, const suites::Plan& plan,
                            const std::string& submission) {
  std::set<std::string> protocols;
  for (const std::string& folder : baselines) {
    records::require_results(folder);
    const records::Manifest manifest = records::manifest_of(folder);
    if (manifest.instance_set != plan.instance_set)
      throw Error(ErrorKind::bad_input, "--baselines: '" + folder +
                                            "' has other instances than the suite; scenes, noise levels, seed or "
                                            "commitment, and instances must be equal");
    records::require_checked(folder, plan_check(context), "--baselines: cannot use");
    for (const records::ManifestMethod& entry : manifest.algorithms) protocols.insert(entry.protocol);
  }
  for (const suites::AlgorithmEntry& entry : plan.suite.algorithms)
    if (!baselines.empty() && entry.name == submission && !protocols.count(entry.protocol))
      throw Error(ErrorKind::bad_input,
                  "--baselines: the submission '" + submission + "' has the protocol '" + entry.protocol +
                      "', the baselines '" + join({protocols.begin(), protocols.end()}, "', '") +
                      "'; they cannot be compared: change 'protocol' in submission.json, or leave --baselines out");
}

void run_trials(Context& context, const EvaluateArguments& arguments, const runner::PreparedPlan& prepared,
                runner::RunOptions& options, runner::RunSummary& summary) {
  ProgressPrinter progress(context.progress_mode());
  options.on_progress = [&](const runner::Progress& now) { progress.update(now); };
  options.on_message = [&](const std::string& text) { progress.message(text); };
  options.workers = arguments.workers;
  summary = runner::run(prepared, options);
  progress.finish();
  if (summary.stopped) throw Error(ErrorKind::stopped, "stopped");
}

// Makes `results` of the run and the baselines. Returns the number of trials that differ between folders.
std::size_t join_results(Context& context, const EvaluateArguments& arguments, const fs::path& run,
                         const fs::path& results) {
  if (arguments.baselines.empty()) {
    fs::rename(run, results);
    return 0;
  }
  records::MergeOptions options;
  options.sources = {run};
  options.sources.insert(options.sources.end(), arguments.baselines.begin(), arguments.baselines.end());
  options.out = results;
  options.command = context.typed_command();
  options.checked = true;
  options.on_message = [](const std::string& note) { print_warning(note); };
  const records::MergeSummary merged = records::merge(options);
  if (merged.missing > 0)
    print_warning(trials_text(merged.missing) +
                  " of the suite are neither in the baselines nor run: with --baselines "
                  "only the submission runs");
  for (const records::Disagreement& one : merged.disagreements)
    print_warning("not reproducible: trial " + one.trial + " " + one.label + ": " + records::to_string(one.difference));
  fs::remove_all(run);
  return merged.disagreeing;
}

Json methods_json(const records::Manifest& manifest, const submissions::Submission& submission) {
  Json methods = Json::array();
  for (const records::ManifestMethod& entry : manifest.algorithms) {
    const bool submitted = entry.name == submission.name;
    const bool stated = submitted && !submission.training.is_null();
    methods.push_back({{"name", entry.name},
                       {"observes", entry.observes},
                       {"protocol", entry.protocol},
                       {"training", stated ? submission.training : json_of(entry.training)},
                       {"submitted", submitted}});
  }
  return methods;
}

Json evaluation_json(const submissions::Submission& submission, const EvaluationFolder& folder,
                     const std::string& suite_text, const runner::PreparedPlan& prepared, bool sandboxed) {
  const suites::Suite& suite = prepared.plan.suite;
  std::set<std::string> observes;
  unsigned steps = 0;
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    if (entry.name != submission.name) continue;
    observes.insert(entry.choice.plugin->observes.begin(), entry.choice.plugin->observes.end());
    steps = entry.steps;
  }
  return {{"format", kFormat},
          {"name", submission.name},
          {"version", submission.version},
          {"archive_sha256", folder.archive_hash()},
          {"suite",
           {{"name", suite.name}, {"sha256", sha256_hex(suite_text)}, {"instance_set", prepared.plan.instance_set}}},
          {"sealed", !suite.commitment.empty()},
          {"sandbox", sandboxed},
          {"date", today()},
          {"program_version", RELIGN_VERSION},
          {"class", observes},
          {"budget", {{"steps", steps}}},
          {"methods", methods_json(records::manifest_of(folder / kResults), submission)},
          {"results", "results"}};
}

// The suite of the evaluation, with the submission checked and tried.
suites::Suite prepare_suite(Context& context, const EvaluateArguments& arguments, const EvaluationFolder& folder,
                            const submissions::Submission& submission, const JsonSource& suite) {
  plugin_host::Catalog& catalog = context.catalog();
  const fs::path unpacked = folder / kUnpacked;
  const Json entry = submissions::submitted_entry(submission, unpacked, kUnpacked, catalog);
  write_file_atomically(folder / "suite.json", submissions::evaluation_suite(suite, entry, catalog));
  suites::Suite read = suites::read_suite(folder / "suite.json", catalog);
  for (const suites::AlgorithmEntry& one : read.algorithms)
    if (one.name == submission.name) submissions::refuse_files_outside(one.choice, unpacked);
  unseal_suite(read, arguments.secret);
  run_self_test(context, submission,
                submissions::submitted_entry(submission, unpacked, fs::absolute(unpacked).string(), catalog));
  return read;
}

int finish(Context& context, const EvaluateArguments& arguments, const EvaluationFolder& folder,
           const submissions::Submission& submission, const runner::RunSummary& summary, const Json& evaluation,
           const report::Report& report, std::size_t disagreeing) {
  write_file_atomically(folder / kEvaluationFile, evaluation.dump(2) + "\n");
  fs::remove(folder / kArchiveHash);
  for (const std::string& failure : summary.failures) print_warning(failure);
  for (const std::string& finding : report.findings()) print_warning("failed check: " + finding);
  if (context.json)
    print_result(Json{{"evaluation", (folder / kEvaluationFile).string()},
                      {"results", (folder / kResults).string()},
                      {"name", submission.name},
                      {"version", submission.version},
                      {"archive_sha256", folder.archive_hash()},
                      {"trials", summary.trials},
                      {"failed", summary.failed},
                      {"disagreeing", disagreeing},
                      {"failed_checks", report.findings()}}
                     .dump(2) +
                 "\n");
  else
    print_text(report.ranking_table() + "\nevaluation  " + folder.path().string() + "\n");
  std::fprintf(stderr, "%s in %s. Next: %s --sandbox%s\n", trials_text(summary.trials).c_str(),
               duration_text(summary.seconds).c_str(),
               own_command("verify " + shell_quoted((folder / kResults).string())).c_str(),
               arguments.secret.empty() ? "" : " --secret FILE");
  if (disagreeing > 0 || !report.findings().empty()) return kGateTripped;
  return summary.failed > 0 ? kTrialsFailed : kDone;
}

int evaluate(Context& context, const EvaluateArguments& arguments) {
  watch_for_stop();
  plugin_host::adopt_orphans();
  const JsonSource suite = JsonSource::from_file(suite_file(arguments.suite));
  std::error_code error;
  if (!fs::is_regular_file(arguments.archive, error))
    throw Error(ErrorKind::bad_input, "ARCHIVE: '" + arguments.archive + "' is not a file; expected what '" +
                                          own_command("submit pack") + "' writes");
  EvaluationFolder folder(fs::path(arguments.out).lexically_normal(), sha256_file(arguments.archive));
  if (arguments.baselines.empty()) folder.reopen_results();
  context.sandboxed = true;
  context.start_sandbox(folder / kOwnRun);
  folder.unpack(arguments.archive);
  const submissions::Submission submission = submissions::read_submission(folder / kUnpacked);
  check_environment(submission, folder / kUnpacked);
  suites::Suite read = prepare_suite(context, arguments, folder, submission, suite);

  runner::RunOptions options;
  options.results = folder / kOwnRun;
  options.stop = &watch_for_stop();
  options.worker_program = {"/proc/self/exe", "worker"};
  options.cache_folder = relign::cache_folder();
  options.command = context.typed_command();
  options.draw_lens = context.extensions.draw_lens;
  options.sandbox = context.sandbox(read.trial_memory_mb);
  if (!arguments.baselines.empty()) options.only = {{"algorithm", submission.name}};
  const runner::PreparedPlan prepared =
      runner::prepare(std::move(read), options.cache_folder, {}, options.stop, options.sandbox);
  refuse_other_baselines(context, arguments.baselines, prepared.plan, submission.name);
  if (!arguments.baselines.empty())  // prices, limits and machine times: better said before the trials than after
    records::require_mergeable(options.results,
                               runner::make_manifest(prepared, runner::hash_libraries(prepared.plan.suite), "", {}),
                               {arguments.baselines.begin(), arguments.baselines.end()});
  write_file_atomically(folder / submissions::kManifestName, submission.text);
  folder.keep();

  runner::RunSummary summary;
  run_trials(context, arguments, prepared, options, summary);
  const std::size_t disagreeing = join_results(context, arguments, options.results, folder / kResults);
  const report::Report report(folder / kResults, std::nullopt, plan_check(context));
  report.write_tables();
  report.write_html(folder / kResults / "report.html");
  return finish(context, arguments, folder, submission, summary,
                evaluation_json(submission, folder, suite.text(), prepared, options.sandbox != nullptr), report,
                disagreeing);
}

}  // namespace

void add_submit_evaluate(CLI::App& submit, Context& context) {
  CLI::App& verb = add_verb(
      submit,
      {"evaluate", "Run a packed method on a suite in a sandbox, and join results of other methods.",
       "relign-bench submit evaluate my_search-1.0.tar.zst --suite leaderboard.json -o evaluations/my_search-1.0 "
       "--baselines results/leaderboard",
       "submit pack, merge, verify, seal"});
  EvaluateArguments& arguments = add_action(verb, context, evaluate, "Stopped. To resume, run the same command:");
  verb.add_option("ARCHIVE", arguments.archive, "archive of a submission, written by submit pack")
      ->required()
      ->type_name("FILE");
  verb.add_option("--suite", arguments.suite, "suite file (JSON), to which the submission is added")
      ->required()
      ->type_name("FILE");
  verb.add_option("-o,--out", arguments.out, "folder to create; an interrupted evaluation in it is resumed")
      ->required()
      ->type_name("DIR");
  verb.add_option(
          "--baselines", arguments.baselines,
          "results folder of the suite's own methods, which then do not run; repeatable [default: run them, too]")
      ->type_name("DIR")
      ->allow_extra_args(false);
  verb.add_option("--jobs,--workers", arguments.workers, "number of trials to run in parallel [default: all cores]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1024U));
  add_secret_option(verb, arguments.secret);
}

}  // namespace relign::cli
