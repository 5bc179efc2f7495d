// The scenes: lens drawing, travel, clock and the error landscape around the nominal pose.
#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/figure_html.h"
#include "report/plane_map.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxScenesOpen = 3;

// "x -1 to 1 mm, Rx -7 to 7 deg"
std::string travel_of(const Json& facts) {
  std::string text;
  for (const Json& axis : list_of(facts, "axes"))
    text += (text.empty() ? "" : ", ") + text_of(axis, "name") + " " + sort_value(axis["lower"]) + " to " +
            sort_value(axis["upper"]) + " " + text_of(axis, "unit");
  return text;
}

// The model of machine time.
std::string clock_text(const Json& facts) {
  const Json& clock = object_of(facts, "machine_time");
  const std::pair<const char*, const char*> parts[] = {{"speed_mm_per_s", " mm/s"},
                                                       {"speed_deg_per_s", " degrees/s"},
                                                       {"settle_ms", " ms to settle"},
                                                       {"exposure_ms", " ms exposure"},
                                                       {"readout_ms", " ms readout"}};
  std::string text;
  for (const auto& [key, unit] : parts)
    if (const Json value = clock.value(key, Json()); value.is_number())
      text += (text.empty() ? "" : ", ") + sort_value(value) + unit;
  return text;
}

bool is_shown(const Json& facts, const std::map<std::string, std::string>& drawings) {
  return !list_of(facts, "axes").empty() || drawings.count(text_of(facts, "scene")) > 0;
}

void drawing(HtmlWriter& html, const std::string& name, const std::string& uri) {
  html.open("figure", {{"class", "plot lens"}});
  html.empty("img", {{"src", uri}, {"alt", "Cross-section of the lens of " + name + " with rays of several fields"}});
  html.element("figcaption", "Cross-section of the nominal lens with rays of several fields.").close();
}

void landscape(HtmlWriter& html, const Json& facts, std::size_t index) {
  if (const std::optional<Figure> figure = landscape_figure(facts, index)) figure_html(html, *figure, false);
  const Json& plane = object_of(object_of(facts, "landscape"), "plane");
  if (plane.empty()) return;
  const std::string across = text_of(plane["across"], "name"), up = text_of(plane["up"], "name");
  html.open("figure", {{"class", "plot"}});
  plane_map(html, plane);
  html.element("figcaption", "Error near the nominal pose over " + across + " and " + up +
                                 " with all other axes fixed. Along a valley the error is insensitive to the pose.");
  html.close();
}

}  // namespace

std::string scene_section(const Json& data, const Gallery& gallery) {
  const Json& scenes = list_of(data, "scene_facts");
  std::size_t shown = 0;
  for (const Json& facts : scenes) shown += is_shown(facts, gallery.drawings) ? 1 : 0;
  if (shown == 0) return "";
  HtmlWriter html;
  html.element("h2", shown == 1 ? "Scene" : "Scenes");
  for (std::size_t index = 0; index < scenes.size(); ++index) {
    const Json& facts = scenes[index];
    if (!is_shown(facts, gallery.drawings)) continue;
    const std::string name = text_of(facts, "scene"), summary = text_of(facts, "summary");
    html.open("details",
              shown <= kMaxScenesOpen ? Attributes{{"class", "scene"}, {"open", ""}} : Attributes{{"class", "scene"}});
    html.open("summary").element("bdi", name).close();
    if (!summary.empty()) html.element("p", summary);
    std::string quiet;
    if (const std::string travel = travel_of(facts); !travel.empty()) quiet = "Travel: " + travel + ". ";
    if (count_of(facts, "width") > 0)
      quiet += "Images of " + text_of(facts, "width") + " x " + text_of(facts, "height") + " pixels. ";
    if (const std::string clock = clock_text(facts); !clock.empty()) quiet += "Simulated machine time: " + clock + ".";
    if (!quiet.empty()) html.element("p", {{"class", "quiet"}}, quiet);
    html.open("div", {{"class", "figures"}});
    const auto found = gallery.drawings.find(name);
    if (found != gallery.drawings.end()) drawing(html, name, found->second);
    landscape(html, facts, index);
    html.close().close();
  }
  return html.take();
}

}  // namespace relign::report
