#include "report/page.h"

#include "base/error.h"
#include "base/hash.h"
#include "markup/escape.h"
#include "report/assets.h"
#include "report/picture_html.h"

namespace relign::report {
namespace {

struct Section {
  const char* id;
  std::vector<void (*)(PageWriter&, const PageParts&)> parts;
};

// In the order of the page, before and after the curves and the replay.
const std::vector<Section> kBefore = {
    {"verdict", {verdict_section}},
    {"aggregate", {aggregate_section}},
    {"ranking", {ranking_section}},
    {"rules", {further_scores_section, specification_section, cost_section, rules_section}},
    {"levels", {levels_section}},
    {"matrix", {matrix_section}},
    {"heat", {heat_section}}};
const std::vector<Section> kAfter = {
    {"pairs", {pairs_section}},          {"training", {training_section}}, {"scene", {scene_section}},
    {"gallery", {gallery_section}},      {"ran", {ran_section}},           {"methods", {methods_section}},
    {"provenance", {provenance_section}}};

// The hash of a script as a source of the content security policy.
std::string script_source(const std::string& script) {
  const std::string hex = sha256_hex(script);
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return "'sha256-" + base64(bytes) + "'";
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

std::string document(std::string_view page_template, std::map<std::string, std::string> parts, const Json& data,
                     std::string_view style) {
  const std::string script(assets::page_js());
  parts["script_sources"] = script_source(script);
  parts["style"] = std::string(assets::page_css()) + std::string(style);
  parts["scripts"] = "<script>" + script + "</script>\n";
  parts["data"] = json_for_script(data);
  return filled(page_template, parts);
}

std::string replay_html(const PageParts& parts) {
  Json charts;
  PageWriter out(charts);
  film_strips(out, parts);
  const std::string strips = out.take();
  return strips.empty() ? "" : filled(assets::replay_html(), {{"strips", strips}});
}

std::string page_html(const PageModel& page, const Gallery& gallery, const FinalErrors& rmse) {
  const PageParts parts = {page, gallery, rmse};
  Json charts = Json::array();
  const auto written = [&](void (*section)(PageWriter&, const PageParts&)) {
    PageWriter out(charts);
    section(out, parts);
    return out.take();
  };
  const auto all = [&](const std::vector<Section>& sections) {
    std::string html;
    for (const Section& section : sections) {
      std::string inside;
      for (const auto& part : section.parts) inside += written(part);
      if (!inside.empty()) html += "<section id=\"" + std::string(section.id) + "\">" + inside + "</section>\n";
    }
    return html;
  };
  std::map<std::string, std::string> places = {
      {"document_title", html_escaped((page.title.empty() ? "results" : page.title) + " - relign-bench")},
      {"title", written(title_section)},
      {"before", all(kBefore)},
      {"curve_cards", written(curve_cards)},
      {"curves_hidden", page.groups.empty() ? "hidden" : ""},
      {"replay", replay_html(parts)},
      {"after", all(kAfter)},
      {"picture_definitions", picture_definitions(gallery)}};
  Json data = curve_data(page);
  data["replay"] = replay_data(page, gallery);
  data["charts"] = std::move(charts);
  return document(assets::page_html(), std::move(places), data);
}

}  // namespace relign::report
