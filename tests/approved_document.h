// Files of the tree that follow from declarations. After a change of these:
//   RELIGN_UPDATE_GOLDEN=1 ctest --test-dir build/release -R documents
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/files.h"

namespace relign::test {

inline std::vector<std::string> split_lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// The lines from the first difference to the last one.
inline std::string differing_lines(const std::string& was, const std::string& is) {
  std::vector<std::string> old = split_lines(was), now = split_lines(is);
  while (!old.empty() && !now.empty() && old.back() == now.back()) old.pop_back(), now.pop_back();
  const auto [from, to] = std::mismatch(old.begin(), old.end(), now.begin(), now.end());
  std::string text;
  std::for_each(from, old.end(), [&text](const std::string& line) { text += "\n- " + line; });
  std::for_each(to, now.end(), [&text](const std::string& line) { text += "\n+ " + line; });
  return text;
}

// Compares a file of the tree with what it should be, or writes it.
inline void approve(const std::filesystem::path& file, const std::string& expected) {
  if (std::getenv("RELIGN_UPDATE_GOLDEN")) write_file_atomically(file, expected);
  if (const std::string found = read_file(file); found != expected)
    ADD_FAILURE() << file << " is stale; update it as this test says at its top" << differing_lines(found, expected);
}

// With a space per level; what fits into a line is in one.
inline std::string pretty(const nlohmann::ordered_json& value, std::size_t indent = 0) {
  constexpr std::size_t kLongest = 130;
  std::string line = value.dump(-1, ' ', false);
  std::string spaced;
  bool text = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && (i == 0 || line[i - 1] != '\\')) text = !text;
    spaced += line[i];
    if (!text && (line[i] == ',' || line[i] == ':')) spaced += ' ';
  }
  if (indent > 0 && spaced.size() + indent <= kLongest) return spaced;
  if (!value.is_structured() || value.empty()) return spaced;
  std::string lines;
  for (const auto& [key, member] : value.items())
    lines += (lines.empty() ? "\n" : ",\n") + std::string(indent + 1, ' ') +
             (value.is_object() ? "\"" + key + "\": " : "") + pretty(member, indent + 1);
  return (value.is_object() ? "{" : "[") + lines + "\n" + std::string(indent, ' ') + (value.is_object() ? "}" : "]");
}

}  // namespace relign::test
