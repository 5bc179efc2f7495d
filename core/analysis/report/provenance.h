// Where results come from, as the manifest records it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "records/manifest.h"

namespace relign::report {

// A folder that was merged.
struct Source {
  std::string folder;
  std::uint64_t trials = 0;
  std::string cpu, program;  // hash of the program
};

struct Provenance {
  std::string suite_name, suite_file, suite_text, seed, instance_set, command;
  std::vector<std::pair<const char*, std::string>> facts;  // name and value, "" if unknown
  std::vector<Source> sources;                             // of a merged folder
  std::uint64_t disagreeing = 0;                           // trials that differ between sources
  std::vector<std::string> disagreements;                  // sentences on the first of them
  std::vector<std::string> notes;                          // on different builds; all those of a merge for this page
  records::Program program;
  records::Machine machine;
  std::optional<records::MergeSummary> merge;
};

Provenance provenance_of(const records::Manifest& manifest);

}  // namespace relign::report
