#include "leaderboard/page_frame.h"

#include "markup/escape.h"
#include "report/assets.h"
#include "report/page.h"

RELIGN_EMBEDDED(relign::leaderboard, board_html)
RELIGN_EMBEDDED(relign::leaderboard, board_css)

namespace relign::leaderboard {

std::string framed(const SitePage& page) {
  Json charts;
  report::PageWriter links(charts);
  std::vector<report::Words> items;
  for (const auto& [address, text] : page.links) items.push_back({{text, "name", "", address}});
  links.list(items);
  return report::document(board_html(),
                          {{"title", html_escaped(page.title)},
                           {"root", page.root},
                           {"board_title", html_escaped(page.board_title)},
                           {"links", links.take()},
                           {"main", page.main},
                           {"definitions", page.definitions}},
                          page.data, board_css());
}

}  // namespace relign::leaderboard
