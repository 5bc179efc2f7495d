// What may stand where the cursor is: verbs, options, ids and words that an option takes, told by the program's own
// arguments, so that no shell's script has a list of them.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace relign::cli {

struct Candidate {
  std::string word;
  std::string description;  // may be empty
};

struct Candidates {
  std::vector<Candidate> words;
  bool files = false;    // files and folders, too
  bool folders = false;  // folders, too
};

// The ids of "scenes", "noise-levels" or "algorithms", or of all plugins (""); `plugins` are the --plugin that were
// typed.
using IdSource =
    std::function<std::vector<Candidate>(const std::string& kind, const std::vector<std::string>& plugins)>;

// `words`: what stands behind the program's name, up to the cursor; the last one is being typed and may be empty.
Candidates complete(const CLI::App& program, const std::vector<std::string>& words, const IdSource& ids);

}  // namespace relign::cli
