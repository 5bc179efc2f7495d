#include "leaderboard/board.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/text.h"
#include "leaderboard/consistency.h"
#include "leaderboard/round.h"
#include "records/merge.h"
#include "records/results_folder.h"
#include "report/figures.h"
#include "report/several_folders.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;

constexpr Caution kNotSealed = {"not sealed", "The instances were not secret: the method may have been tuned to them."};
constexpr Caution kNoSandbox = {"no sandbox",
                                "The method ran with the rights of a user: it could read files and other processes."};
constexpr std::size_t kMostDisagreements = 5;

// An evaluation whose parts do not contradict each other.
struct Candidate {
  Entry entry;
  records::Manifest manifest;  // of the results
  bool has_optima = false;     // of their instances
};

Candidate read_candidate(const fs::path& folder, const records::PlanCheck& plan) {
  Candidate made;
  made.entry.evaluation = read_evaluation(folder);
  made.entry.submission = read_submission(folder);
  const Evaluation& evaluation = made.entry.evaluation;
  std::error_code ignored;
  if (fs::is_symlink(evaluation.results_folder(), ignored))
    throw Error(ErrorKind::bad_input, "'" + evaluation.results_folder().string() + "' is a link, not a folder");
  const report::LoadedResults results = report::load_results(evaluation.results_folder(), plan);
  if (const auto found = contradictions(evaluation, made.entry.submission, results); !found.empty())
    throw Error(ErrorKind::bad_input, join(found, "\n"));
  made.manifest = results.manifest;
  made.has_optima = std::any_of(results.trials.rows.begin(), results.trials.rows.end(),
                                [](const auto& row) { return !std::isnan(row.own_optimum_mse); });
  made.entry.checked = records::summary_of(results.checks);
  made.entry.replays = records::read_replays(evaluation.results_folder());
  if (const auto& replays = made.entry.replays; replays && replays->all.equal < replays->all.replayed)
    throw Error(ErrorKind::bad_input, "replay: " + std::to_string(replays->all.replayed - replays->all.equal) + " of " +
                                          counted(replays->all.replayed, "replayed trial") +
                                          " gave different numbers, as verify.json states");
  if (!evaluation.sealed) made.entry.cautions.push_back(kNotSealed);
  if (!evaluation.sandbox) made.entry.cautions.push_back(kNoSandbox);
  return made;
}

bool submits(const Evaluation& evaluation, const std::string& method, const std::string& protocol) {
  return std::any_of(evaluation.methods.begin(), evaluation.methods.end(), [&](const EvaluatedMethod& one) {
    return one.submitted && one.name == method && one.protocol == protocol;
  });
}

// Why an evaluation cannot be shown beside an earlier one; empty if it can.
std::string conflict(const Candidate& earlier, const Candidate& candidate) {
  const Evaluation &a = earlier.entry.evaluation, &b = candidate.entry.evaluation;
  const std::string other = "'" + a.folder.string() + "'";
  if (a.name == b.name && a.version == b.version && a.archive_sha256 != b.archive_sha256)
    return "version '" + b.version + "' of '" + b.name + "' is another archive in " + other +
           "; a changed submission needs a new version";
  if (a.suite.instance_set != b.suite.instance_set) return "";
  // What a folder must share with the others of its round besides the instances (records/merge.h).
  if (const std::string key =
          first_differing(earlier.manifest, candidate.manifest, {"limits", "machine_time", "cycle", "cost"});
      !key.empty())
    return "'" + key + "' of the suite differs from that of " + other + ", which has the same instances";
  if (a.name == b.name) return "";
  for (const records::ManifestMethod& entry : candidate.manifest.algorithms) {
    const records::ManifestMethod* known = earlier.manifest.method(entry.name, entry.protocol);
    if (!known) continue;
    if (submits(a, entry.name, entry.protocol) && submits(b, entry.name, entry.protocol))
      return "the method '" + entry.name + "' is submitted as '" + a.name + "' in " + other;
    if (const std::string key = first_differing(*known, entry, {"plugin", "parameters", "merit", "steps"});
        !key.empty())
      return "the method '" + entry.name + "' is another one in " + other + ": its '" + key + "' differs";
  }
  return "";
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char letter : text) {
    if (letter == '\n')
      lines.emplace_back();
    else
      lines.back() += letter;
  }
  return lines;
}

// By date; of one day in the given order.
std::vector<Candidate> accepted(const BoardOptions& options, std::vector<LeftOut>& left_out) {
  std::vector<Candidate> all, kept;
  for (const fs::path& folder : options.folders) {
    try {
      all.push_back(read_candidate(folder, options.plan));
    } catch (const Error& error) {
      left_out.push_back({folder.string(), lines_of(error.what())});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
    return a.entry.evaluation.date < b.entry.evaluation.date;
  });
  std::set<std::string> with_optima;  // instance sets
  for (const Candidate& candidate : all)
    if (candidate.has_optima) with_optima.insert(candidate.entry.evaluation.suite.instance_set);
  for (Candidate& candidate : all) {
    std::string reason;
    // Whichever is earlier: without optima no method of the round would be ranked.
    if (!candidate.has_optima && with_optima.count(candidate.entry.evaluation.suite.instance_set))
      reason = "its records lack the optima of the instances, which another evaluation of the round has";
    for (const Candidate& earlier : kept)
      if (reason.empty()) reason = conflict(earlier, candidate);
    if (reason.empty())
      kept.push_back(std::move(candidate));
    else
      left_out.push_back({candidate.entry.evaluation.folder.string(), {reason}});
  }
  return kept;
}

std::string report_file(const Evaluation& evaluation) {
  const std::string key = evaluation.name + "\n" + evaluation.version + "\n" + evaluation.suite.instance_set + "\n" +
                          evaluation.date + "\n" + evaluation.archive_sha256;
  return "reports/" + report::figure_file_name(evaluation.name).substr(0, 60) + "-" + short_hash(key) + ".html";
}

// Merges the entries' results, or uses those of the only one.
fs::path merged(Round& round, const std::vector<Entry>& entries, const report::TemporaryFolder& place) {
  if (round.entries.size() == 1) return entries[round.entries.front()].evaluation.results_folder();
  records::MergeOptions options;
  options.checked = true;
  // Earliest first: of records that differ, the earliest are kept.
  for (auto entry = round.entries.rbegin(); entry != round.entries.rend(); ++entry)
    options.sources.push_back(entries[*entry].evaluation.results_folder());
  options.out = place.path() / short_hash(round.suite.instance_set);
  const records::MergeSummary summary = records::merge(options);
  for (std::size_t i = 0; i < std::min(kMostDisagreements, summary.disagreements.size()); ++i)
    round.alarms.push_back("records differ: " + summary.disagreements[i].label + " between '" +
                           summary.disagreements[i].kept + "' and '" + summary.disagreements[i].other +
                           "': " + records::to_string(summary.disagreements[i].difference));
  if (summary.disagreeing > kMostDisagreements)
    round.alarms.push_back("records differ in " + counted(summary.disagreeing, "trial") + " altogether");
  return options.out;
}

// The trainings of a list share a row.
records::ReplayCounts replays_of(const Entry& entry, const std::map<std::string, std::string>& lists,
                                 const Standing& standing, const std::string& protocol) {
  records::ReplayCounts all;
  if (!entry.replays) return all;
  for (const auto& [key, counts] : entry.replays->methods) {
    const auto list = lists.find(key.first);
    if ((list == lists.end() ? key.first : list->second) != standing.method || key.second != protocol) continue;
    all.recorded += counts.recorded;
    all.replayed += counts.replayed;
    all.equal += counts.equal;
  }
  return all;
}

void add_submissions(Round& round, const std::vector<Entry>& entries, const std::map<std::string, std::string>& lists) {
  for (BoardClass& of_class : round.classes)
    for (Standing& standing : of_class.standings)
      for (const std::size_t entry : round.entries) {
        if (submits(entries[entry].evaluation, standing.method, of_class.protocol)) {
          standing.submitted = true;
          standing.entry = entry;
        }
        const records::ReplayCounts counts = replays_of(entries[entry], lists, standing, of_class.protocol);
        if (counts.replayed <= standing.replays.replayed) continue;
        const records::Replays& by = *entries[entry].replays;
        standing.replays = counts;
        standing.replayed_by = (by.by.empty() ? "by an unnamed person" : "by " + by.by) + " with " + by.program +
                               (by.date.empty() ? "" : " on " + by.date);
      }
}

// Entries are latest first, and so are rounds.
std::vector<Round> rounds_of(const std::vector<Entry>& entries, const BoardOptions& options) {
  std::vector<Round> rounds;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Evaluation& evaluation = entries[i].evaluation;
    auto round = std::find_if(rounds.begin(), rounds.end(), [&](const Round& one) {
      return one.suite.instance_set == evaluation.suite.instance_set;
    });
    if (round == rounds.end()) {
      round = rounds.emplace(rounds.end());
      round->suite = evaluation.suite;
      round->steps = evaluation.steps;
      round->date = evaluation.date;
    }
    if (std::none_of(round->entries.begin(), round->entries.end(),
                     [&](std::size_t later) { return entries[later].evaluation.name == evaluation.name; }))
      round->entries.push_back(i);
  }
  const report::TemporaryFolder place;
  for (Round& round : rounds) {
    std::vector<EvaluatedMethod> listed;
    for (const std::size_t entry : round.entries)
      listed.insert(listed.end(), entries[entry].evaluation.methods.begin(), entries[entry].evaluation.methods.end());
    const fs::path results = merged(round, entries, place);
    read_standings(round, results, listed, options.baseline, true);
    add_submissions(round, entries, report::training_lists(records::manifest_of(results)));
  }
  return rounds;
}

// The results of an entry's submitted methods: in its round, or alone for a version that a later one replaces there.
Version version_of(std::size_t entry, const std::vector<Entry>& entries, const std::vector<Round>& rounds,
                   const BoardOptions& options) {
  const Evaluation& evaluation = entries[entry].evaluation;
  const auto round = std::find_if(rounds.begin(), rounds.end(), [&](const Round& one) {
    return std::find(one.entries.begin(), one.entries.end(), entry) != one.entries.end();
  });
  Round alone;
  if (round == rounds.end())
    read_standings(alone, evaluation.results_folder(), evaluation.methods, options.baseline, false);
  const Round& standings = round == rounds.end() ? alone : *round;
  Version version;
  version.entry = entry;
  for (const EvaluatedMethod& method : evaluation.methods) {
    const BoardClass* of_class = nullptr;
    const Standing* standing =
        method.submitted ? find_standing(standings, method.name, method.protocol, &of_class) : nullptr;
    if (!standing) continue;
    const auto ranked = std::count_if(of_class->standings.begin(), of_class->standings.end(),
                                      [](const Standing& one) { return one.rank > 0; });
    version.results.push_back({method.name, method.protocol, standing->error, standing->trials, standing->failed,
                               standing->rank, static_cast<std::size_t>(ranked)});
  }
  return version;
}

std::vector<History> histories_of(const std::vector<Entry>& entries, const std::vector<Round>& rounds,
                                  const BoardOptions& options) {
  std::vector<History> histories;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::string& name = entries[i].evaluation.name;
    auto history =
        std::find_if(histories.begin(), histories.end(), [&](const History& one) { return one.name == name; });
    if (history == histories.end()) history = histories.insert(histories.end(), {name, {}});
    history->versions.push_back(version_of(i, entries, rounds, options));
  }
  return histories;
}

}  // namespace

std::string method_page(const std::string& method) {
  return "methods/" + report::figure_file_name(method).substr(0, 60) + "-" + short_hash(method).substr(0, 8) + ".html";
}

Board make_board(const BoardOptions& options) {
  Board board;
  board.title = options.title;
  board.baseline = options.baseline;
  board.plan = options.plan;
  std::vector<Candidate> candidates = accepted(options, board.left_out);
  if (candidates.empty()) {
    std::string reasons;
    for (const LeftOut& one : board.left_out) reasons += "\n  '" + one.folder + "': " + join(one.reasons, "; ");
    throw Error(ErrorKind::bad_input, "no evaluation can be shown:" + reasons);
  }
  for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate) {
    candidate->entry.report = report_file(candidate->entry.evaluation);
    board.entries.push_back(std::move(candidate->entry));
  }
  board.rounds = rounds_of(board.entries, options);
  board.histories = histories_of(board.entries, board.rounds, options);
  return board;
}

}  // namespace relign::leaderboard
