#include "report/page.h"

#include "base/error.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "report/assets.h"
#include "report/escape.h"
#include "report/sections.h"

namespace relign::report {
namespace {

// The page's content policy allows exactly these scripts: markup that slipped in could not run.
std::string script_source(const std::string& script) {
  const std::string hex = sha256_hex(script);
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return "'sha256-" + base64(bytes) + "'";
}

// What the script needs of the data; the rest already stands in the page as text.
Json curve_data(const Json& data) {
  Json methods = Json::array(), groups = Json::array();
  for (const Json& method : data["methods"])
    methods.push_back({{"name", method["name"]}, {"oracle", flag_of(method, "oracle")}});
  for (const Json& group : data["groups"]) groups.push_back({{"label", group["label"]}, {"curves", group["curves"]}});
  return {{"methods", methods}, {"groups", groups}};
}

}  // namespace

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

std::string page(const Json& data, const Gallery& gallery, const std::map<std::string, double>& rmse) {
  const std::string dygraphs = assets::dygraphs_js();
  const std::string curves(assets::curves_js());
  const std::string script(assets::page_js());
  const std::string name = text_of(data, "suite_name");
  return filled(
      assets::page_html(),
      {{"script_sources", script_source(dygraphs) + " " + script_source(curves) + " " + script_source(script)},
       {"document_title", html_escaped((name.empty() ? "results" : name) + " - relign-bench")},
       {"style", assets::dygraphs_css() + std::string(assets::page_css())},
       {"title", title_section(data)},
       {"verdict", verdict_section(data)},
       {"ranking", ranking_section(data)},
       {"curve_cards", curve_cards(data, gallery)},
       {"curves_hidden", data["groups"].empty() ? "hidden" : ""},
       {"gallery", gallery_section(data, gallery, rmse)},
       {"ran", ran_section(data, gallery)},
       {"methods", methods_section(data)},
       {"provenance", provenance_section(data)},
       {"picture_definitions", picture_definitions(gallery)},
       {"dygraphs_licence", html_escaped(assets::dygraphs_licence())},
       {"data", json_for_script(curve_data(data))},
       {"dygraphs", dygraphs},
       {"curves_script", curves},
       {"script", script}});
}

}  // namespace relign::report
