#include "cli/argument_fault.h"

#include <regex>
#include <utility>

namespace relign::cli {

std::string argument_fault(const std::string& text) {
  static const std::pair<std::regex, const char*> kFaults[] = {
      {std::regex(R"(([^:]*): Value ([^]*) not in range \[?(\S+) (?:to|-) ([^\s\]]+)\]?)"),
       "$1: found '$2', expected $3 to $4"},
      {std::regex(R"(([^:]*): ([^]*) not in \{(.*)\})"), "$1: found '$2', expected one of $3"},
      {std::regex(R"(Could not convert: (\S+) = ([^]*))"), "$1: found '$2', expected a number"},
      {std::regex(R"(([^:]*): Value ([^]*) could not be converted)"), "$1: found '$2', expected a number"},
      {std::regex(R"(([^:]*): \d+ required (\S+) missing)"), "$1: missing value $2"},
      {std::regex(R"((\S+) requires (\S+))"), "$1 also needs $2"},
      {std::regex(R"((\S+) excludes (\S+))"), "$1 cannot be combined with $2"},
  };
  for (const auto& [pattern, words] : kFaults)
    if (std::regex_match(text, pattern)) return std::regex_replace(text, pattern, words);
  return text;
}

}  // namespace relign::cli
