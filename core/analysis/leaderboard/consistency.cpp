#include "leaderboard/consistency.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "base/baselines.h"
#include "base/json_members.h"
#include "base/text.h"

namespace relign::leaderboard {
namespace {

using report::LoadedResults;
using NameAndProtocol = std::pair<std::string, std::string>;

constexpr std::size_t kMostNamed = 20;

std::string named(const NameAndProtocol& method) {
  return in_quotes(method.first) + " (protocol " + in_quotes(method.second) + ")";
}

std::string words_text(const std::set<std::string>& words) {
  return in_quotes(join({words.begin(), words.end()}, ", "));
}

void check_origin(std::vector<std::string>& found, const Evaluation& evaluation, const Submission& submission,
                  const records::Manifest& manifest) {
  const auto differs = [&](const char* what, const std::string& here, const std::string& there, const char* file) {
    if (here != there)
      found.push_back(std::string(what) + " is " + in_quotes(here) + " in evaluation.json and " + in_quotes(there) +
                      " in " + file);
  };
  differs("the name", evaluation.name, submission.name, "submission.json");
  differs("the version", evaluation.version, submission.version, "submission.json");
  differs("the instance set", evaluation.suite.instance_set, manifest.instance_set, "the results' manifest");
  const std::vector<records::Program> builds = manifest.builds();
  if (manifest.program.version != evaluation.program_version &&
      std::none_of(builds.begin(), builds.end(),
                   [&](const records::Program& one) { return one.version == evaluation.program_version; }))
    found.push_back("no trial was recorded by relign-bench " + in_quotes(evaluation.program_version));
  if (!manifest.has_suites())
    found.push_back("the results' manifest lacks the text of its suite, with which it could be compared");
  if (evaluation.sealed && !manifest.sealed()) found.push_back("'sealed' is true, but the results have no commitment");
  if (evaluation.sandbox && !manifest.ran_in_sandbox())
    found.push_back("'sandbox' is true, but no algorithm of the results ran in a sandbox");
}

void check_observations(std::vector<std::string>& found, const EvaluatedMethod& method,
                        const records::ManifestMethod& entry) {
  const std::set<std::string> recorded(entry.observes.begin(), entry.observes.end());
  const std::set<std::string> stated(method.observes.begin(), method.observes.end());
  if (recorded != stated)
    found.push_back(named({method.name, method.protocol}) + " observes " + words_text(stated) +
                    " by evaluation.json and " + words_text(recorded) + " by the results");
}

bool is_cost(double stated, const Json& recorded) {
  return recorded.is_number() ? stated == recorded.get<double>() : std::isnan(stated);
}

// A submission states the cost of its own training; all others have it from their plugins.
void check_training(std::vector<std::string>& found, const EvaluatedMethod& method, const Submission& submission,
                    const records::ManifestMethod& entry) {
  const bool own = method.submitted && !submission.training.is_null();
  const Json recorded = own ? submission.training : json_of(entry.training);
  const TrainingCost stated = method.training.value_or(TrainingCost());
  if (method.training.has_value() == !recorded.is_null() && is_cost(stated.steps, member(recorded, "steps")) &&
      is_cost(stated.images, member(recorded, "images")) && is_cost(stated.hours, member(recorded, "hours")))
    return;
  found.push_back("the cost of training of " + named({method.name, method.protocol}) +
                  " in evaluation.json is not that in " + (own ? "submission.json" : "the results' manifest"));
}

// Numbers and switches; files have other names where the trials ran.
void check_parameters(std::vector<std::string>& found, const EvaluatedMethod& method, const Submission& submission,
                      const records::ManifestMethod& entry) {
  if (!submission.parameters.is_object()) return;
  for (const auto& [name, stated] : submission.parameters.items()) {
    const Json& recorded = member(entry.parameters, name.c_str());
    if ((stated.is_number() || stated.is_boolean()) && stated != recorded)
      found.push_back("parameter " + in_quotes(name) + " of " + named({method.name, method.protocol}) + " is " +
                      stated.dump() + " in submission.json and " + recorded.dump() + " in the results' manifest");
  }
}

void check_submitted(std::vector<std::string>& found, const Evaluation& evaluation, const EvaluatedMethod& method,
                     const Submission& submission, const records::ManifestMethod& entry) {
  check_parameters(found, method, submission, entry);
  if (entry.steps != evaluation.steps)
    found.push_back("the budget is " + counted(evaluation.steps, "step") + " in evaluation.json, but " +
                    named({method.name, method.protocol}) + " had " + std::to_string(entry.steps));
}

// Methods that the harness adds to every run need not be listed.
void check_methods(std::vector<std::string>& found, const Evaluation& evaluation, const Submission& submission,
                   const records::Manifest& manifest) {
  std::set<NameAndProtocol> listed;
  const bool has_own = std::any_of(evaluation.methods.begin(), evaluation.methods.end(),
                                   [&](const EvaluatedMethod& one) { return one.name == evaluation.name; });
  for (const EvaluatedMethod& method : evaluation.methods) {
    const NameAndProtocol key = {method.name, method.protocol};
    listed.insert(key);
    if (has_own && method.submitted != (method.name == evaluation.name))
      found.push_back(named(key) +
                      (method.submitted ? " is marked as submitted, but the submission is "
                                        : " is marked as a baseline, but it is the submission ") +
                      in_quotes(evaluation.name));
    if (method.submitted && method.observes != evaluation.observes)
      found.push_back("the class is " + in_quotes(join(evaluation.observes, ", ")) + ", but " + named(key) +
                      " observes " + in_quotes(join(method.observes, ", ")));
    const records::ManifestMethod* entry = manifest.method(method.name, method.protocol);
    if (!entry) {
      found.push_back("the results have no method " + named(key));
      continue;
    }
    check_observations(found, method, *entry);
    check_training(found, method, submission, *entry);
    if (method.submitted) check_submitted(found, evaluation, method, submission, *entry);
  }
  for (const records::ManifestMethod& entry : manifest.algorithms)
    if (const NameAndProtocol key(entry.name, entry.protocol); !listed.count(key) && !entry.added)
      found.push_back("evaluation.json does not list the method " + named(key) + " of the results");
}

// "Better than random" is worth what random is.
void check_baselines(std::vector<std::string>& found, const records::Manifest& manifest) {
  for (const records::ManifestMethod& entry : manifest.algorithms) {
    const std::string baseline = baseline_like(entry.listed_name());
    if (!baseline.empty() && entry.plugin != baseline)
      found.push_back(named({entry.name, entry.protocol}) + " reads as the baseline " + in_quotes(baseline) +
                      ", but it is the plugin " + in_quotes(entry.plugin));
  }
}

// A trial that is left out would count for the method, so every method needs all of them.
void check_trials(std::vector<std::string>& found, const LoadedResults& results) {
  const std::size_t recorded = results.trials.rows.size();
  if (results.planned == 0) found.push_back("the results plan no trials");
  if (recorded < results.planned)
    found.push_back(std::to_string(results.planned - recorded) + " of " + counted(results.planned, "planned trial") +
                    " are not in the results");
  const records::Manifest& manifest = results.manifest;
  const std::uint64_t of_each = manifest.scenes.size() * manifest.noise_levels.size() * manifest.instances;
  std::map<NameAndProtocol, std::set<std::string>> trials;
  for (const statistics::TrialRow& row : results.trials.rows) {
    const statistics::Series& series = results.trials.series_of(row);
    trials[{series.algorithm, series.protocol}].insert(series.scene + "\n" + series.noise_level + "\n" +
                                                       std::to_string(row.instance));
  }
  for (const records::ManifestMethod& entry : manifest.algorithms) {
    const NameAndProtocol key = {entry.name, entry.protocol};
    if (trials[key].size() != of_each)
      found.push_back(named(key) + " has " + counted(trials[key].size(), "trial") + " instead of " +
                      std::to_string(of_each));
  }
}

}  // namespace

std::vector<std::string> contradictions(const Evaluation& evaluation, const Submission& submission,
                                        const LoadedResults& results) {
  std::vector<std::string> found = records::findings_of(results.checks);
  check_origin(found, evaluation, submission, results.manifest);
  check_methods(found, evaluation, submission, results.manifest);
  check_baselines(found, results.manifest);
  check_trials(found, results);
  if (found.size() > kMostNamed) {
    const std::size_t more = found.size() - kMostNamed;
    found.resize(kMostNamed);
    found.push_back("and " + std::to_string(more) + " more");
  }
  return found;
}

}  // namespace relign::leaderboard
