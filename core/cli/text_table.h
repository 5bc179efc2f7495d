// A table in plain text: columns as wide as their widest cell.
#pragma once

#include <string>
#include <vector>

namespace relign::cli {

class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : rows_{std::move(header)} {}
  // What a terminal would obey, and line ends, stand in a cell as text (base/text.h).
  void add(std::vector<std::string> row);
  // Numbers are right-aligned, everything else left-aligned; no blanks at line ends.
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace relign::cli
