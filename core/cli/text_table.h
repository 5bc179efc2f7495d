// A plain-text table; columns are as wide as their widest cell.
#pragma once

#include <string>
#include <vector>

namespace relign::cli {

class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : rows_{std::move(header)} {}
  // Control characters in cells are escaped (printable, base/text.h); line ends and tabs become spaces.
  void add(std::vector<std::string> row);
  // Columns of numbers are right-aligned, all others left-aligned; no trailing spaces.
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace relign::cli
