#include "report/page.h"

#include "base/error.h"
#include "base/hash.h"
#include "markup/escape.h"
#include "report/assets.h"
#include "report/picture_html.h"
#include "report/sections.h"

namespace relign::report {

std::string script_source(const std::string& script) {
  const std::string hex = sha256_hex(script);
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return "'sha256-" + base64(bytes) + "'";
}

std::string filled(std::string_view page_template, const std::map<std::string, std::string>& parts) {
  std::string out;
  std::size_t at = 0;
  while (true) {
    const std::size_t open = page_template.find("{{", at);
    if (open == std::string_view::npos) break;
    const std::size_t close = page_template.find("}}", open);
    const std::string name(page_template.substr(open + 2, close == std::string_view::npos ? 0 : close - open - 2));
    const auto part = parts.find(name);
    if (part == parts.end()) throw Error(ErrorKind::internal, "the report's template names an unknown part: " + name);
    out += page_template.substr(at, open - at);
    out += part->second;
    at = close + 2;
  }
  out += page_template.substr(at);
  return out;
}

std::string page_html(const PageModel& page, const Gallery& gallery, const std::map<std::string, double>& rmse) {
  // The chart library, the page's own scripts, and the one that starts them.
  std::string sources, scripts;
  for (const std::string& script :
       {assets::dygraphs_js(), std::string(assets::sorting_js()), std::string(assets::curves_js()),
        std::string(assets::replay_js()), std::string(assets::page_js())}) {
    sources += (sources.empty() ? "" : " ") + script_source(script);
    scripts += "<script>" + script + "</script>\n";
  }
  const std::string replay = replay_section(page, gallery);
  Json for_scripts = curve_data(page);
  for_scripts["replay"] = replay_data(page, gallery);
  return filled(assets::page_html(),
                {{"script_sources", sources},
                 {"document_title", html_escaped((page.title.empty() ? "results" : page.title) + " - relign-bench")},
                 {"style", assets::dygraphs_css() + std::string(assets::page_css())},
                 {"title", title_section(page)},
                 {"verdict", verdict_section(page)},
                 {"aggregate", aggregate_section(page)},
                 {"ranking", ranking_section(page)},
                 {"rules", specification_section(page) + cost_section(page) + rules_section(page)},
                 {"levels", levels_section(page)},
                 {"matrix", matrix_section(page)},
                 {"heat", heat_section(page)},
                 {"curve_cards", curve_cards(page, gallery)},
                 {"curves_hidden", page.groups.empty() ? "hidden" : ""},
                 {"replay", replay},
                 {"replay_hidden", replay.empty() ? "hidden" : ""},
                 {"pairs", pairs_section(page)},
                 {"training", training_section(page)},
                 {"scene", scene_section(page, gallery)},
                 {"gallery", gallery_section(page, gallery, rmse)},
                 {"ran", ran_section(page, gallery)},
                 {"methods", methods_section(page)},
                 {"provenance", provenance_section(page)},
                 {"picture_definitions", picture_definitions(gallery)},
                 {"dygraphs_licence", html_escaped(assets::dygraphs_licence())},
                 {"data", json_for_script(for_scripts)},
                 {"scripts", scripts}});
}

}  // namespace relign::report
