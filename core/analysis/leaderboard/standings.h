// Parts that the index and the pages of methods share: tables of standings, flags, texts of numbers.
#pragma once

#include <string>
#include <vector>

#include "leaderboard/board.h"
#include "report/page_writer.h"

namespace relign::leaderboard {

// "Observes images and design", "Observes nothing but its own moves", "Oracles".
std::string class_title(const BoardClass& of_class);

// "0.123 (0.10-0.15)"; "-" without numbers.
std::string error_text(const statistics::Band& error);
// "1.7 h, 412800 steps, AMD EPYC"; "none" without training.
std::string training_text(const std::optional<TrainingCost>& training);

// "not sealed", "no sandbox", "3 of 30 trials failed"; each with an explanation.
void add_condition_flags(report::Words& words, const Entry& entry);
void add_failure_flag(report::Words& words, std::size_t failed, std::size_t trials);
report::Cell failed_cell(std::size_t failed, std::size_t trials);

// Without rows.
report::Table standings_table(const Board& board, const std::string& caption);
void add_standing(report::Table& table, const Board& board, const BoardClass& of_class, const Standing& standing,
                  const std::string& root);

}  // namespace relign::leaderboard
