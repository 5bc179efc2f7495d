// Positions of JSON values in their text, as lines and columns. Used by json_source.cpp only.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relign {

// Byte offset to line and column without a scan of the whole text: every line may have a mistake.
class LineTable {
 public:
  explicit LineTable(const std::string& text);
  // Both from 1. `text` is the text of the constructor.
  std::pair<int, int> line_and_column(const std::string& text, std::size_t offset) const;

 private:
  struct Mark {
    int line = 1;
    std::size_t begin = 0;  // offset of the line's first byte
  };
  std::vector<Mark> marks_;
};

// Offset of a value and of the values inside it. A tree, because a table of JSON pointers would repeat long keys for
// every value below them.
struct JsonPlace {
  struct Inner {
    std::vector<JsonPlace> items;
    std::map<std::string, JsonPlace> members;
  };
  std::size_t offset = 0;
  std::unique_ptr<Inner> inner;  // null for values that are neither list nor object
};

// The place of a JSON pointer, or of its innermost existing ancestor.
const JsonPlace& place_of(const JsonPlace& root, std::string_view pointer);

}  // namespace relign
