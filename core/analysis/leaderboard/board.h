// All numbers and texts of a leaderboard: evaluations grouped into rounds, rounds into classes. docs/leaderboard.md
// defines the terms.
//
//   round    evaluations on the same instances; only they are compared. The latest version of each submission counts
//   class    methods that observe the same under the same protocol; only they are ranked against each other
//   history  all evaluations of one submission
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "leaderboard/evaluation.h"
#include "records/folder_checks.h"
#include "records/replays.h"
#include "report/page_model.h"
#include "report/pictures.h"

namespace relign::leaderboard {

struct BoardOptions {
  std::vector<std::filesystem::path> folders;
  std::string title = "Leaderboard";
  std::string baseline = "random";  // name or id of the method with which all are compared
  records::PlanCheck plan = {};     // of every results folder
};

// What a reader must know about the conditions of an evaluation.
struct Caution {
  const char *tag, *text;  // "not sealed", and a sentence
};

struct Entry {
  Evaluation evaluation;
  Submission submission;
  std::string report;  // file of its report in the site
  std::vector<Caution> cautions;
  std::string checked;                      // which checks of the results were made
  std::optional<records::Replays> replays;  // of the results
};

// A method in its class.
struct Standing {
  std::string method;  // name in the results
  std::string page;    // file in the site
  bool submitted = false;
  std::optional<std::size_t> entry;  // of Board::entries, if submitted
  std::size_t rank = 0;              // 0: not ranked
  std::string not_ranked;            // why
  statistics::Band error;            // interquartile mean of the normalised error
  statistics::Band mean_error;       // which includes outliers
  std::vector<double> by_step;       // mean error after each image, from that of the start
  // Probabilities to end with a lower error on the same instance; n is 0 if not computed.
  statistics::Band beats_baseline, beaten_by_best;
  std::size_t trials = 0, failed = 0;  // failed ones count among the trials, and as error 1
  records::ReplayCounts replays;       // of the evaluation in which most of its trials were replayed
  std::string replayed_by;             // who, and with which version
  // Medians over the trials that did not fail.
  double images = statistics::kMissing, machine_seconds = statistics::kMissing, compute_seconds = statistics::kMissing;
  std::optional<TrainingCost> training;
  std::string training_tag;

  // Of one alignment.
  double seconds() const { return machine_seconds + (std::isnan(compute_seconds) ? 0 : compute_seconds); }
};

struct BoardClass {
  std::vector<std::string> observes;
  std::string protocol;
  bool oracles = false;             // not ranked
  std::vector<Standing> standings;  // best first; without numbers last
};

struct Round {
  Evaluation::Suite suite;
  std::string commitment, secret;  // of a sealed suite; the secret once it is published
  unsigned steps = 0;
  // Name in the results of the method with which all are compared: the one of the wanted name, else the only one that
  // is the plugin or preset of this name. "" if there is none.
  std::string baseline;
  std::string about_baseline;        // what a reader must know about it; "": it is what its name says
  std::vector<std::size_t> entries;  // of Board::entries, merged here
  std::string date;                  // of the latest
  std::vector<report::Stratum> strata;
  std::size_t instances = 0;
  std::vector<BoardClass> classes;
  std::vector<std::string> alarms;  // failed quality gates and disagreements, as sentences
  report::PageModel page;           // of the merged results
  report::Gallery gallery;
};

// One evaluation of a submission.
struct Version {
  std::size_t entry = 0;  // of Board::entries
  struct Result {
    std::string method, protocol;
    statistics::Band error;
    std::size_t trials = 0, failed = 0;
    std::size_t rank = 0, of = 0;  // in its class, among the methods of the evaluation; 0: not ranked
  };
  std::vector<Result> results;
};

struct History {
  std::string name;
  std::vector<Version> versions;  // latest first
};

struct LeftOut {
  std::string folder;
  std::vector<std::string> reasons;
};

struct Board {
  std::string title, baseline;
  records::PlanCheck plan;     // for the report of each entry
  std::vector<Entry> entries;  // latest first
  std::vector<Round> rounds;   // latest first
  std::vector<History> histories;
  std::vector<LeftOut> left_out;
};

// Reads all folders. A folder that is damaged or contradicts itself or another one is listed in Board::left_out. Throws
// Error: bad_input if all are left out; io if the temporary folder for merging cannot be written.
Board make_board(const BoardOptions& options);

// File of a method's page, different for different names whatever they contain.
std::string method_page(const std::string& method);

}  // namespace relign::leaderboard
