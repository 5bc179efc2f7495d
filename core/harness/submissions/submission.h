// submission.json: what a submitted method is, who made it, and what it cost (docs/submitting.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::submissions {

inline constexpr const char* kManifestName = "submission.json";

// The trial with which a submission is tried before it is packed, and before it is evaluated.
struct SelfTest {
  std::string scene = "gaussian_spot", noise_level = "rho0";
  unsigned steps = 5;
};

struct Submission {
  std::string name, version, summary;
  std::vector<std::string> authors;
  std::string licence, citation, homepage;
  std::string use;              // the plugin's id, the id of a shipped algorithm, or the path of a document
  Json parameters;              // object; files by their paths in the archive
  std::string merit, protocol;  // empty: the suite's
  std::string plugin;           // path in the archive; empty: a shipped algorithm
  Json training;                // object with some of steps, images, hours, hardware; null: not stated
  std::string environment;      // path of a lock file in the archive; empty: none
  SelfTest self_test;
  std::string text;  // verbatim
};

// Throws Error(bad_input) that lists every mistake, also paths that lead out of the archive.
Submission read_submission(const JsonSource& source);

// The same for the submission in this folder. Throws Error(bad_input) also for a file that the manifest names and the
// folder lacks, and for a manifest of more than a megabyte.
Submission read_submission(const std::filesystem::path& folder);

}  // namespace relign::submissions
