#include "base/json_places.h"

#include <algorithm>
#include <charconv>

namespace relign {
namespace {

constexpr std::size_t kStride = 4096;

std::string unescaped(std::string_view token) {
  std::string key;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const bool code = token[i] == '~' && i + 1 < token.size();
    key += !code ? token[i] : token[++i] == '1' ? '/' : '~';
  }
  return key;
}

}  // namespace

LineTable::LineTable(const std::string& text) {
  Mark mark;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (at % kStride == 0) marks_.push_back(mark);
    if (text[at] == '\n') mark = {mark.line + 1, at + 1};
  }
  if (marks_.empty()) marks_.push_back(mark);
}

std::pair<int, int> LineTable::line_and_column(const std::string& text, std::size_t offset) const {
  offset = std::min(offset, text.size());
  const std::size_t stride = std::min(offset / kStride, marks_.size() - 1);
  Mark mark = marks_[stride];
  for (std::size_t at = stride * kStride; at < offset; ++at)
    if (text[at] == '\n') mark = {mark.line + 1, at + 1};
  return {mark.line, static_cast<int>(offset - mark.begin) + 1};
}

const JsonPlace& place_of(const JsonPlace& root, std::string_view pointer) {
  const JsonPlace* found = &root;
  while (!pointer.empty() && found->inner) {
    pointer.remove_prefix(1);
    const std::string_view token = pointer.substr(0, pointer.find('/'));
    pointer.remove_prefix(token.size());
    const JsonPlace::Inner& inner = *found->inner;
    if (inner.members.empty()) {
      std::size_t index = 0;
      const auto end = token.data() + token.size();
      if (std::from_chars(token.data(), end, index).ptr != end || index >= inner.items.size()) break;
      found = &inner.items[index];
    } else {
      const auto member = inner.members.find(unescaped(token));
      if (member == inner.members.end()) break;
      found = &member->second;
    }
  }
  return *found;
}

}  // namespace relign
