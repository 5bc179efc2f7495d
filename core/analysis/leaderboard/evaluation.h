// An evaluation folder, as `submit evaluate` writes it and `leaderboard build` reads it (docs/leaderboard.md):
//
//   submission.json   the submission's manifest
//   evaluation.json   what was evaluated, on which suite, under which conditions
//   results/          the results folder
//
// It is untrusted input: `results` must be a folder inside, and files have limited sizes.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::leaderboard {

inline constexpr const char* kEvaluationFormat = "relign-bench/evaluation/1";
inline constexpr std::size_t kMaxEvaluationBytes = 4'000'000;  // of each of the two JSON files

// Cost of a training, once. NaN: not stated.
struct TrainingCost {
  double steps = std::numeric_limits<double>::quiet_NaN();
  double images = std::numeric_limits<double>::quiet_NaN();
  double hours = std::numeric_limits<double>::quiet_NaN();
  std::string hardware;  // "" if not stated
};

// A method of the results under one protocol.
struct EvaluatedMethod {
  std::string name;                   // in the results
  std::vector<std::string> observes;  // words of its manifest
  std::string protocol;
  std::optional<TrainingCost> training;  // nullopt: not trained
  bool submitted = false;                // else a baseline
};

struct Evaluation {
  std::filesystem::path folder;  // not written
  std::string name, version;     // of the submission
  std::string archive_sha256;    // 64 hex digits
  struct Suite {
    std::string name, sha256, instance_set;
  } suite;
  bool sealed = false, sandbox = false;
  std::string date;  // YYYY-MM-DD, perhaps with a time: 2026-11-24T17:05:00Z
  std::string program_version;
  std::vector<std::string> observes;  // member "class": what the submitted method observes, sorted
  unsigned steps = 0;                 // budget
  std::vector<EvaluatedMethod> methods;
  std::string results = "results";  // name of the results folder within

  std::filesystem::path results_folder() const { return folder / results; }
};

// What the board shows of a submission's manifest.
struct Submission {
  std::string name, version, summary, licence, citation, homepage;  // "" if not stated
  std::vector<std::string> authors;
  Json training;    // its cost as stated; null if not
  Json parameters;  // of the algorithm; null if not stated
};

// Throw Error: io if a file cannot be read; bad_input with all mistakes of the file.
Evaluation read_evaluation(const std::filesystem::path& folder);
Submission read_submission(const std::filesystem::path& folder);  // unknown members are ignored

// evaluation.json (docs/schemas/evaluation.schema.json).
Json to_json(const Evaluation& evaluation);

}  // namespace relign::leaderboard
