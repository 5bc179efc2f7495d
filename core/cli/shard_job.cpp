#include "cli/shard_job.h"

#include "base/error.h"
#include "runner/provenance.h"

namespace relign::cli {
namespace {

// Parses "3/40"; false for anything else.
bool parse_shard(const std::string& text, unsigned& number, unsigned& count) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return false;
  const auto whole = [](const std::string& digits, unsigned& value) {
    if (digits.empty() || digits.size() > 7 || digits.find_first_not_of("0123456789") != std::string::npos)
      return false;
    value = static_cast<unsigned>(std::stoul(digits));
    return true;
  };
  return whole(text.substr(0, slash), number) && whole(text.substr(slash + 1), count);
}

}  // namespace

ShardJob::ShardJob(const std::string& plan_file, const std::string& shard, bool sandboxed) {
  unsigned count = 0;
  if (!parse_shard(shard, number_, count))
    throw Error(ErrorKind::bad_input, "--shard: '" + shard + "' is not of the form i/n, such as 3/40");
  plan_ = runner::read_plan(plan_file);
  if (plan_.sandbox && !sandboxed)
    throw Error(ErrorKind::bad_input, "--plan: '" + plan_file +
                                          "' was made with --sandbox, so that its algorithms run in a sandbox only; "
                                          "add --sandbox, or make a plan without it");
  const std::string shards = std::to_string(plan_.shards);
  if (count != plan_.shards)
    throw Error(ErrorKind::bad_input, "--shard " + shard + ": " + plan_file + " has " + shards + " shards, not " +
                                          std::to_string(count) + "; use --shard " + std::to_string(number_) + "/" +
                                          shards + ", or make a plan with --shards " + std::to_string(count));
  if (number_ >= count)
    throw Error(ErrorKind::bad_input, "--shard " + shard + ": shards are numbered from 0; the last one is " +
                                          std::to_string(count - 1) + "/" + shards);
}

suites::Suite ShardJob::read_suite(plugin_host::Catalog& catalog) const {
  suites::Suite suite =
      suites::read_suite(JsonSource::from_text(plan_.suite, plan_.suite_file), plan_.folder(), catalog);
  suite.name = plan_.name;
  return suite;
}

std::unique_ptr<runner::ShardAttempt> ShardJob::begin(const std::filesystem::path& results,
                                                      runner::PreparedPlan& prepared,
                                                      const std::function<void(const std::string&)>& on_message) const {
  runner::check_unchanged(plan_, prepared);
  if (const std::string& program = plan_.program.hash; !program.empty() && program != runner::this_program().hash)
    on_message("this build of relign-bench differs from the one that made the plan; use the same build for all shards");
  auto attempt = std::make_unique<runner::ShardAttempt>(results, number_, plan_.hash, on_message);
  std::vector<suites::PlannedTrial> remaining;
  std::size_t elsewhere = 0;
  for (const std::size_t place : runner::places_of_shard(prepared.plan, number_, plan_.shards)) {
    suites::PlannedTrial& trial = prepared.plan.trials[place];
    if (attempt->done_elsewhere().count(trial.id))
      ++elsewhere;
    else
      remaining.push_back(std::move(trial));
  }
  if (elsewhere > 0)
    on_message(std::to_string(elsewhere) + " of " + std::to_string(elsewhere + remaining.size()) +
               " trials of this shard were completed by an earlier attempt");
  prepared.plan.trials = std::move(remaining);
  prepared.shard = records::Shard{number_, plan_.shards, plan_.hash, plan_.trials};
  return attempt;
}

}  // namespace relign::cli
