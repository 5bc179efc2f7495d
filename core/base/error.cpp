#include "base/error.h"

namespace relign {

std::string Problem::to_string() const {
  std::string text;
  if (!file.empty()) {
    text = file;
    if (line > 0) text += ":" + std::to_string(line) + (column > 0 ? ":" + std::to_string(column) : "");
    text += ": ";
  }
  if (!pointer.empty()) text += pointer + ": ";
  return text + message;
}

void throw_if_any(const std::vector<Problem>& problems) {
  if (problems.empty()) return;
  std::string text;
  for (const Problem& problem : problems) {
    if (!text.empty()) text += "\n";
    text += problem.to_string();
  }
  throw Error(ErrorKind::bad_input, text);
}

}  // namespace relign
