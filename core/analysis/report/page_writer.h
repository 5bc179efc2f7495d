// Writes a page from words, tables, lists and charts. Sections and the leaderboard state what to show; all markup is in
// page_writer.cpp. The result is complete without scripts, except charts, which chart.js draws from specifications.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "markup/html_writer.h"
#include "report/figures.h"
#include "report/page_numbers.h"

namespace relign::report {

// A piece of a line. `look` is its CSS class; "name" is text from results, whose writing direction is isolated,
// "strong" is bold, "code" is code.
struct Word {
  std::string text;
  std::string look = "";
  std::string hint = "", link = "";  // tooltip; address
};
struct Words : std::vector<Word> {
  Words() = default;
  Words(const char* text) : Words(std::string(text)) {}          // NOLINT(google-explicit-constructor)
  Words(const std::string& text) : std::vector<Word>{{text}} {}  // NOLINT(google-explicit-constructor)
  Words(std::initializer_list<Word> words) : std::vector<Word>(words) {}
  Words& add(const std::string& text, const std::string& look = "", const std::string& hint = "") {
    if (!text.empty()) push_back({text, look, hint});
    return *this;
  }
};

struct Cell {
  Words words;
  std::optional<std::string> sort = std::nullopt;  // by which the column is sorted, instead of the text
  std::string kind = "";
  std::string hint = "";                                      // tooltip
  std::optional<std::array<double, 3>> range = std::nullopt;  // low, middle, high from 0 to 1: a bar with a dot
  std::size_t span = 1;                                       // columns
};
inline constexpr const char* kDash = "\u2013";                                // between the ends of an interval
std::string open_interval(const statistics::Interval& interval, int digits);  // "LOW-HIGH", "LOW or more", ""
Cell number_cell(const std::string& text);
Cell number_cell(double value, int digits = 3);  // sorted by the exact value
// The estimate in bold, then its interval or other text in brackets.
Cell estimate_cell(double sort, const std::string& text, const std::string& interval, const std::string& hint = "");
Cell share_cell(double share, const statistics::Interval& interval);     // "57 % (40-72)"
Cell arrival_cell(double median, const statistics::Interval& interval);  // "not reached" if infinite, "-" if unknown
Cell range_cell(const statistics::Band& band);                           // on a scale from 0 to 1
Cell method_cell(const std::string& method, bool oracle, const std::string& training_tag);
Cell no_cell(const std::string& kind = "number");  // "-"

struct Head {
  std::string title, unit = "", hint = "";
  std::string kind = "";  // of the whole column: "name", "number", "range", ...
  std::string link = "";
};
struct TableRow {
  std::vector<Cell> cells;
  std::string kind = "";  // "group" and "class" are titles that stay above their rows
};
struct Table {
  std::string kind = "";  // CSS class
  std::string caption = "";
  std::vector<Head> heads;
  std::vector<std::vector<TableRow>> bodies = {{}};  // sorted one by one
  bool sortable = true;

  void add(std::vector<Cell> cells, const std::string& row_kind = "") {
    bodies.back().push_back({std::move(cells), row_kind});
  }
  void add_title(Words words,
                 const std::string& row_kind);  // a row over all columns, in a new body unless a title precedes it
};

// A column that states its own cells, for a row of results.
template <class Source>
struct ColumnOf : Head {
  std::function<Cell(const Source&)> cell;
};

class PageWriter {
 public:
  explicit PageWriter(Json& charts) : charts_(charts) {}  // to which the specifications are added

  PageWriter& heading(int level, const Words& words, const std::string& id = "");
  PageWriter& text(const Words& words, const std::string& kind = "");
  PageWriter& list(const std::vector<Words>& items, const std::string& kind = "");
  PageWriter& facts(const std::vector<std::pair<std::string, Words>>& facts);  // those without words are left out
  PageWriter& code(const std::string& text);
  PageWriter& table(const Table& table);
  PageWriter& chart(const Figure& figure);
  PageWriter& chart(const std::string& name, const std::string& caption, Json specification);
  PageWriter& first_chart();  // of the first screen: error by image of a chosen group, filled by curves.js
  // Radio buttons, whose style rules show what is chosen: class and id are `name` and a number. One option is not
  // shown.
  PageWriter& choice(const std::string& title, const std::string& name, const std::vector<std::string>& options,
                     std::size_t chosen);
  PageWriter& open(const std::string& kind, const std::string& id = "");
  PageWriter& unfold(const Words& summary, const std::string& kind = "", bool open = false);
  PageWriter& close();  // what was opened last

  std::string take() { return html_.take(); }
  HtmlWriter& html() { return html_; }

 private:
  void words(const Words& words);
  void row(const TableRow& row, const std::vector<Head>& heads);
  HtmlWriter html_;
  Json& charts_;
};

}  // namespace relign::report
