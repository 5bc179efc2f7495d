#include "cli/text_table.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/text.h"

namespace relign::cli {
namespace {

bool is_number(const std::string& cell) {
  char* end = nullptr;
  std::strtod(cell.c_str(), &end);
  return !cell.empty() && *end == '\0';
}

}  // namespace

void TextTable::add(std::vector<std::string> row) {
  for (std::string& cell : row) {
    cell = printable(cell);
    std::replace_if(
        cell.begin(), cell.end(), [](char letter) { return letter == '\n' || letter == '\t'; }, ' ');
  }
  rows_.push_back(std::move(row));
}

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  std::vector<bool> numeric;
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    widths.resize(std::max(widths.size(), rows_[row].size()), 0);
    numeric.resize(widths.size(), true);
    for (std::size_t column = 0; column < rows_[row].size(); ++column) {
      widths[column] = std::max(widths[column], rows_[row][column].size());
      if (row > 0 && !is_number(rows_[row][column]) && rows_[row][column] != "-") numeric[column] = false;
    }
  }
  std::string text;
  for (const std::vector<std::string>& row : rows_) {
    std::string line;
    for (std::size_t column = 0; column < row.size(); ++column) {
      if (column > 0) line += "  ";
      const std::string padding(widths[column] - row[column].size(), ' ');
      line += numeric[column] ? padding + row[column] : row[column] + padding;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace relign::cli
