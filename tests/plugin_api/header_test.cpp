// The tree's C headers are the frozen one, or grew from it: what is there stays, and more comes only at the ends.
// Places and sizes are pinned by frozen_1_0/abi_layout.h; this reads the declarations, with their types.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "base/files.h"

namespace relign {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string trimmed(const std::string& text) {
  const std::string words = std::regex_replace(text, std::regex("\\s+"), " ");
  const std::size_t first = words.find_first_not_of(' ');
  return first == std::string::npos ? "" : words.substr(first, words.find_last_not_of(' ') - first + 1);
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char letter : text) {
    depth += (letter == '(' || letter == '{') - (letter == ')' || letter == '}');
    if (letter == separator && depth == 0)
      parts.emplace_back();
    else
      parts.back() += letter;
  }
  for (std::string& part : parts) part = trimmed(part);
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

// A header without comments: macros by name, and declarations by their first words, each with its parts in order.
struct Declarations {
  explicit Declarations(std::string text) {
    for (std::size_t start = text.find("/*"); start != std::string::npos; start = text.find("/*"))
      text.replace(start, text.find("*/", start) + 2 - start, " ");
    std::string code;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      std::smatch found;
      if (line.rfind('#', 0) != 0)
        code += line + "\n";
      else if (std::regex_match(line, found, std::regex("#define (\\w+)(.*)")))
        macros[found[1]] = trimmed(found[2]);
    }
    code = std::regex_replace(code, std::regex("extern \"C\" \\{|\\n\\}\\s*\\n"), "\n");
    for (const std::string& declaration : split(code, ';')) {
      const std::size_t open = declaration.find('{'), close = declaration.rfind('}');
      if (open == std::string::npos) {
        parts[declaration] = {};
        continue;
      }
      const std::string inside = declaration.substr(open + 1, close - open - 1);
      const bool constants = declaration.rfind("enum", 0) == 0;
      const auto members = split(inside, constants ? ',' : ';');
      parts[constants ? "enum of " + members.at(0) : declaration.substr(0, open - 1)] = members;
    }
  }
  std::map<std::string, std::string> macros;
  std::map<std::string, std::vector<std::string>> parts;
};

// A sentence for everything that was there and is not, or is not in its place.
std::vector<std::string> losses(const std::string& before_text, const std::string& after_text) {
  const Declarations before(before_text), after(after_text);
  std::vector<std::string> sentences;
  for (const auto& [name, value] : before.macros) {
    const auto found = after.macros.find(name);
    if (name != "RELIGN_ABI_MINOR" && (found == after.macros.end() || found->second != value))
      sentences.push_back("the macro " + name + " was changed");
  }
  for (const auto& [name, members] : before.parts) {
    const auto found = after.parts.find(name);
    if (found == after.parts.end()) {
      sentences.push_back("'" + name + "' is gone");
      continue;
    }
    for (std::size_t i = 0; i < members.size(); ++i)
      if (i >= found->second.size() || found->second[i] != members[i])
        sentences.push_back("'" + members[i] + "' of '" + name + "' was changed, moved or removed");
  }
  return sentences;
}

// The C headers of a folder as one text.
std::string headers_of(const std::filesystem::path& folder) {
  std::string text;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".h") text += read_file(entry.path()) + "\n";
  return text;
}

const std::string kFrozen = headers_of(RELIGN_FROZEN_HEADERS);
const std::string kToday = headers_of(RELIGN_HEADERS);

std::string changed(const std::string& from, const std::string& to) {
  std::string text = kFrozen;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(FrozenHeader, IsTheBeginningOfTodays) {
  EXPECT_THAT(losses(kFrozen, kToday), IsEmpty()) << "version 1 is frozen: a change may only append";
  EXPECT_THAT(losses(kFrozen, headers_of(RELIGN_GROWN_HEADERS)), IsEmpty());
}

TEST(FrozenHeader, ALongerOneHasALaterMinorVersion) {
  const Declarations frozen(kFrozen), today(kToday);
  EXPECT_EQ(frozen.macros.at("RELIGN_ABI_MINOR"), "0");
  if (today.macros.at("RELIGN_ABI_MINOR") != "0") return;
  EXPECT_EQ(today.parts, frozen.parts) << "the header has grown: raise RELIGN_ABI_MINOR";
  EXPECT_EQ(today.macros, frozen.macros) << "the header has grown: raise RELIGN_ABI_MINOR";
}

TEST(FrozenHeader, WhatIsNoGrowthIsTold) {
  EXPECT_THAT(Declarations(kFrozen).parts.size(), testing::Ge(30U));
  EXPECT_THAT(losses(kFrozen, changed("RELIGN_STOP = 1", "RELIGN_STOP = 2")),
              ElementsAre(HasSubstr("'RELIGN_STOP = 1'")));
  EXPECT_THAT(losses(kFrozen, changed("double merit;", "float merit;")), ElementsAre(HasSubstr("'double merit'")));
  EXPECT_THAT(losses(kFrozen, changed("  double merit;", "  double more; double merit;")), testing::SizeIs(5))
      << "everything behind it moved";
  EXPECT_THAT(losses(kFrozen, changed("uint32_t most_steps,", "uint64_t most_steps,")),
              ElementsAre(HasSubstr("of 'typedef struct relign_run_service'")));
  EXPECT_THAT(losses(kFrozen, changed("relign.scene/1", "relign.scene/2")),
              ElementsAre("the macro RELIGN_SCENE_INTERFACE was changed"));
  EXPECT_THAT(losses(kFrozen, changed("typedef struct relign_assembly relign_assembly;", "")),
              ElementsAre(HasSubstr("is gone")));
  EXPECT_THAT(losses(kFrozen, changed("  const float* pixels;  ", "  const void* pixels;  ")),
              ElementsAre(HasSubstr("'const float* pixels'")));
}

}  // namespace
}  // namespace relign
