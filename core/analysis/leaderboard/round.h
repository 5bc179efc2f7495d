// The standings of one results folder: what board.h calls a round, without its evaluations.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "leaderboard/board.h"

namespace relign::leaderboard {

// Sets everything of `round` except suite, steps, entries and date; `steps` is read. `listed`: methods of
// evaluation.json, for training costs. `pictures`: also reads the gallery. Throws Error as report::load_results.
void read_standings(Round& round, const std::filesystem::path& results, const std::vector<EvaluatedMethod>& listed,
                    const std::string& baseline, bool pictures);

// Why no method is ranked: a sentence each; empty if one is.
std::vector<std::string> reasons_without_ranking(const Round& round);

// The standing of a method; nullptr without one.
const Standing* find_standing(const Round& round, const std::string& method, const std::string& protocol,
                              const BoardClass** of_class = nullptr);

// The name of the method to which a series belongs: of several trainings it is that of the list.
std::string method_of(const statistics::Series& series);

}  // namespace relign::leaderboard
