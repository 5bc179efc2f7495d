// Parts that the index and the pages of methods share: tables of standings, flags, texts of numbers.
#pragma once

#include <string>
#include <vector>

#include "leaderboard/board.h"
#include "markup/html_writer.h"

namespace relign::leaderboard {

inline constexpr const char* kTo = "\u2013";  // between the ends of an interval

// "Observes images and design", "Observes nothing but its own moves", "Oracles".
std::string class_title(const BoardClass& of_class);

// "0.123 (0.10-0.15)"; "-" without numbers.
std::string error_text(const statistics::Band& error);
std::string percent_text(const statistics::Band& share);  // "83 % (75-90)"; "-"
// "1.7 h, 412800 steps, AMD EPYC"; "none" without training.
std::string training_text(const std::optional<TrainingCost>& training);

// "not sealed", "no sandbox", "3 of 30 trials failed"; each with an explanation.
void condition_flags(HtmlWriter& html, const Entry& entry);
void failure_flag(HtmlWriter& html, std::size_t failed, std::size_t trials);

// An entry of a definition list; nothing for an empty value.
void fact(HtmlWriter& html, const char* name, const std::string& value);

// A region that scrolls sideways by keyboard, too.
void open_scroll(HtmlWriter& html, const std::string& label);

// The ranking of a class. The caption is for screen readers, since a heading is above the table.
void class_table(HtmlWriter& html, const Board& board, const BoardClass& of_class, const std::string& caption);
// The row of one method, on its page.
void standing_table(HtmlWriter& html, const Board& board, const BoardClass& of_class, const Standing& standing,
                    const std::string& caption, const std::string& root);

}  // namespace relign::leaderboard
