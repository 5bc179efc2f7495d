#include "submissions/environment_lock.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "base/error.h"
#include "base/text.h"

namespace relign::submissions {
namespace {

constexpr std::size_t kMaxPackages = 1000;

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\\");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r\\") + 1 - begin);
}

bool is_word(const std::string& word, const std::string& signs) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [&](char letter) {
    return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || (letter >= '0' && letter <= '9') ||
           signs.find(letter) != std::string::npos;
  });
}

}  // namespace

std::string normalised_package(std::string_view name) {
  std::string normal;
  for (const char letter : name) {
    const bool sign = letter == '-' || letter == '_' || letter == '.';
    if (sign && !normal.empty() && normal.back() == '-') continue;
    const bool capital = letter >= 'A' && letter <= 'Z';
    normal += sign ? '-' : capital ? static_cast<char>(letter - 'A' + 'a') : letter;
  }
  return normal;
}

Packages read_lock(const std::string& text, const std::string& file) {
  Packages packages;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const bool has_marker = line.find(';') != std::string::npos;
    std::string requirement = line.substr(0, line.find_first_of("#;"));
    if (const std::size_t hash = requirement.find("--hash="); hash != std::string::npos) requirement.resize(hash);
    requirement = trimmed(requirement);
    if (requirement.empty()) continue;
    const std::size_t equals = requirement.find("==");
    const std::string name = trimmed(requirement.substr(0, equals));
    const std::string version = equals == std::string::npos ? "" : trimmed(requirement.substr(equals + 2));
    if (!is_word(name, "._-") || !is_word(version, "._-+!"))
      throw Error(ErrorKind::bad_input, file + ":" + std::to_string(number) + ": found '" + requirement.substr(0, 100) +
                                            "'; expected 'name==version', as 'pip freeze' prints it");
    if (!has_marker) packages[normalised_package(name)] = version;
    if (packages.size() > kMaxPackages)
      throw Error(ErrorKind::bad_input, file + ": more than " + std::to_string(kMaxPackages) + " packages");
  }
  return packages;
}

std::string missing_packages(const Packages& locked, const Packages& installed) {
  std::vector<std::string> missing;
  for (const auto& [name, version] : locked) {
    const auto found = installed.find(name);
    if (found == installed.end())
      missing.push_back(name + " " + version + " (not installed)");
    else if (found->second != version)
      missing.push_back(name + " " + version + " (found " + found->second + ")");
  }
  return join(missing, ", ");
}

}  // namespace relign::submissions
