// The frame of every page of the site: head with policy and style, navigation, main part, footer.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/json_source.h"

namespace relign::leaderboard {

struct SitePage {
  std::string title;                                       // plain text, of the window
  std::string root;                                        // relative path of the site's folder: "" or "../"
  std::string board_title;                                 // plain text, in the navigation
  std::vector<std::pair<std::string, std::string>> links;  // of the navigation: address, text
  std::string main;                                        // HTML
  std::string definitions;                                 // HTML: pictures that the main part uses
  Json data = Json::object();                              // of the scripts: charts, and perhaps the replay
};

// The page is self-contained, and its policy allows its own scripts only.
std::string framed(const SitePage& page);

}  // namespace relign::leaderboard
