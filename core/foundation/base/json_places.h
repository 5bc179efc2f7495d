// Where the values of a JSON text stand, as lines and columns. Used by json_source.cpp alone.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relign {

// Without going through the whole text for each place: there may be a mistake in every line.
class LineTable {
 public:
  explicit LineTable(const std::string& text);
  // Both from 1, of a byte of the text that this was made from.
  std::pair<int, int> line_and_column(const std::string& text, std::size_t offset) const;

 private:
  struct Mark {
    int line = 1;
    std::size_t begin = 0;  // of the line
  };
  std::vector<Mark> marks_;
};

// Where a value begins, and those in it. A table by pointers would repeat long keys for every value below them.
struct JsonPlace {
  struct Inner {
    std::vector<JsonPlace> items;
    std::map<std::string, JsonPlace> members;
  };
  std::size_t offset = 0;
  std::unique_ptr<Inner> inner;  // null: neither list nor object
};

// The innermost place on the way of a JSON pointer.
const JsonPlace& place_of(const JsonPlace& root, std::string_view pointer);

}  // namespace relign
