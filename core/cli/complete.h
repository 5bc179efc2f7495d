// Completions at the cursor: verbs, options, ids and values, derived from the program's own arguments, so that the
// shells' scripts contain no lists of them.
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
  bool files = false;    // also offer files and folders
  bool folders = false;  // also offer folders
};

// Ids of "scenes", "noise-levels", "algorithms" or, for "", of all plugins. `plugins` are the --plugin values typed so
// far.
using IdSource =
    std::function<std::vector<Candidate>(const std::string& kind, const std::vector<std::string>& plugins)>;

// `words` are the words after the program's name, up to the cursor; the last one is being typed and may be empty.
Candidates complete(const CLI::App& program, const std::vector<std::string>& words, const IdSource& ids);

}  // namespace relign::cli
