// Reads the table of allowed arrows and finds includes and links of a source tree that break it.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace relign::arrows {

class Arrows {
 public:
  // Lines "left -> right right ..."; `#` starts a comment. Throws std::runtime_error for other lines.
  explicit Arrows(const std::string& table);

  bool knows_room(const std::string& room) const { return direct_.count(room) > 0 || pointed_at_.count(room) > 0; }

  // May `file` ("cli/verb_lens.cpp"), a file of `room`, include `header` ("optics/trace.h")?
  bool allows_include(const std::string& room, const std::string& file, const std::string& header) const;
  // May the target of `room` link the target of `other`? Any file of either may be the reason.
  bool allows_link(const std::string& room, const std::string& other) const;

 private:
  // Everything reachable from one left side, rooms ("optics") and single files ("plugin_api/relign/random.hpp").
  std::set<std::string> reachable(const std::string& left) const;
  std::map<std::string, std::vector<std::string>> direct_;
  std::set<std::string> pointed_at_;
};

// One sentence per wrong arrow in the tree's core/, plugins/ and examples/, sorted by place.
std::vector<std::string> wrong_arrows(const std::filesystem::path& root, const Arrows& arrows);

}  // namespace relign::arrows
