// The static site of a board: index.html, a page per method, a report per evaluation, feed.json.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "leaderboard/board.h"

namespace relign::leaderboard {

std::string index_html(const Board& board);
// `method`: a Standing::method of some round.
std::string method_html(const Board& board, const std::string& method);

// Methods of all rounds, each once, in order of first appearance.
std::vector<std::string> methods_of(const Board& board);

// Writes the site; `folder` is created, or has an earlier site, whose pages of methods and evaluations that are gone
// are removed. Returns the files relative to it. Throws Error: bad_input for a folder with other files; io.
std::vector<std::string> write_site(const Board& board, const std::filesystem::path& folder);

}  // namespace relign::leaderboard
