#include "leaderboard/page_frame.h"

#include "base/error.h"
#include "markup/escape.h"
#include "markup/html_writer.h"
#include "report/assets.h"
#include "report/page.h"

namespace relign::leaderboard {
namespace {

namespace assets = report::assets;

constexpr std::string_view kFrame = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {{script_sources}}; base-uri 'none'; form-action 'none'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="relign-bench">
<meta name="referrer" content="no-referrer">
<link rel="icon" href="data:,">
<title>{{title}}</title>
<style>{{style}}</style>
</head>
<body class="board">
<a class="skip" href="#main">Skip to the content</a>
{{navigation}}
<main id="main" tabindex="-1">
{{main}}
</main>
{{footer}}
{{definitions}}
<script type="application/json" id="report-data">{{data}}</script>
{{scripts}}</body>
</html>
)";

// Beside the report's style.
constexpr std::string_view kStyle = R"(
:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; border-radius: 2px; }
main:focus { outline: none; }
.skip { position: absolute; left: 8px; top: -60px; padding: 6px 14px; background: var(--paper); border: 2px solid var(--accent); border-radius: 6px; z-index: 9; }
.skip:focus { top: 8px; }
.board nav { display: flex; flex-wrap: wrap; gap: 4px 20px; align-items: baseline; margin: 0 0 14px; padding-bottom: 8px; border-bottom: 1px solid var(--line); }
.board nav .home { font-weight: 600; text-decoration: none; overflow-wrap: anywhere; }
.board nav ul { display: flex; flex-wrap: wrap; gap: 4px 18px; margin: 0; padding: 0; list-style: none; min-width: 0; }
.board nav li { min-width: 0; overflow-wrap: anywhere; }
.board p, .board li { max-width: 100ch; }
.board caption { text-align: left; color: var(--quiet); font-size: 13px; padding: 2px 0 6px; }
.board h3 { margin-top: 26px; }
.board figcaption, .board caption, .board th.name, .board .broken { overflow-wrap: anywhere; }
.board caption.unseen { position: absolute; width: 1px; height: 1px; padding: 0; overflow: hidden; clip-path: inset(50%); }
.board .ranking th.name { min-width: 190px; width: 250px; max-width: 330px; }
.board .ranking .rank { display: inline-block; min-width: 1.7em; color: var(--quiet); font-weight: 600; }
.board tr.best .rank { color: var(--accent); }
.board .who { display: block; margin-left: 1.7em; color: var(--quiet); font-size: 12.5px; font-weight: normal; }
.board .flag { white-space: nowrap; font-size: 11.5px; border-radius: 8px; padding: 0 7px; color: var(--bad); background: var(--bad-back); font-weight: 500; font-style: normal; }
.board .mine { white-space: nowrap; font-size: 11.5px; border-radius: 8px; padding: 0 7px; color: var(--good); background: var(--good-back); font-weight: 500; }
.board td.words { white-space: normal; min-width: 150px; overflow-wrap: anywhere; }
.board ul.plain { margin: 6px 0; padding-left: 20px; overflow-wrap: anywhere; }
.board .scroll { padding-bottom: 2px; }
.board footer { margin-top: 44px; padding-top: 10px; border-top: 1px solid var(--line); color: var(--quiet); font-size: 13px; }
@media (max-width: 640px) {
  .board .ranking thead th.name, .board .ranking tbody tr:not(.group) th { min-width: 150px; width: 150px; max-width: 150px; }
  .board dl { grid-template-columns: minmax(0, 1fr); gap: 0; }
  .board dd { margin-bottom: 6px; }
  .board .who { margin-left: 0; }
}
@media print { .skip, .board nav { display: none; } }
)";

std::string navigation_html(const SitePage& page) {
  HtmlWriter html;
  html.open("header").open("nav", {{"aria-label", "Site"}});
  html.open("a", {{"class", "home"}, {"href", page.root + "index.html"}}).element("bdi", page.board_title).close();
  if (!page.links.empty()) html.open("ul");
  for (const auto& [address, text] : page.links)
    html.open("li").open("a", {{"href", address}}).element("bdi", text).close().close();
  return html.take();
}

std::string footer_html(const SitePage& page) {
  HtmlWriter html;
  html.open("footer").open("p").text("All numbers of this site: ");
  html.element("a", {{"href", page.root + "feed.json"}}, "feed.json");
  html.text(
      ". Errors are normalised: 0 is the instance's own optimum, 1 is no better than the start. Intervals are "
      "95 % confidence intervals by a stratified bootstrap over instances.");
  return html.take();
}

}  // namespace

std::string framed(const SitePage& page) {
  return report::document(kFrame,
                          {{"title", html_escaped(page.title)},
                           {"navigation", navigation_html(page)},
                           {"main", page.main},
                           {"footer", footer_html(page)},
                           {"definitions", page.definitions}},
                          page.data, kStyle);
}

std::string replay_html(const std::string& strips) {
  const std::string_view page = assets::page_html();
  constexpr std::string_view kEnd = "</section>";
  const std::size_t begin = page.find("<section id=\"replay\"");
  const std::size_t end = begin == std::string_view::npos ? begin : page.find(kEnd, begin);
  if (end == std::string_view::npos) throw Error(ErrorKind::internal, "the report's page has no replay");
  return report::filled(page.substr(begin, end + kEnd.size() - begin), {{"replay", strips}, {"replay_hidden", ""}});
}

}  // namespace relign::leaderboard
