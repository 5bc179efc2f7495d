#include "base/error.h"

#include <algorithm>

#include "base/text.h"

namespace relign {
namespace {

std::string printable_excerpt(const std::string& message) {
  if (message.size() <= kLongestError) return printable(message);
  std::size_t cut = kLongestError;
  while (cut > kLongestError - 4 && (static_cast<unsigned char>(message[cut]) & 0xC0U) == 0x80) --cut;
  return printable(message.substr(0, cut)) + "... (" + std::to_string(message.size() - cut) + " more bytes)";
}

std::string listed(const std::vector<Problem>& problems) {
  std::string text;
  for (std::size_t i = 0; i < std::min(problems.size(), kMaxProblems); ++i)
    text += (i > 0 ? "\n" : "") + problems[i].to_string();
  if (problems.size() > kMaxProblems)
    text += "\nand " + std::to_string(problems.size() - kMaxProblems) + " more mistakes";
  return text;
}

}  // namespace

Error::Error(ErrorKind kind, const std::string& message)
    : std::runtime_error(printable_excerpt(message)), kind_(kind) {}

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

ProblemsError::ProblemsError(const std::vector<Problem>& problems)
    : Error(ErrorKind::bad_input, listed(problems)),
      problems_(std::make_shared<const std::vector<Problem>>(problems)) {}

void throw_if_any(const std::vector<Problem>& problems) {
  if (!problems.empty()) throw ProblemsError(problems);
}

}  // namespace relign
