// The scenes: lens drawing, travel, clock and the error landscape around the nominal pose.
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/figure_html.h"
#include "report/plane_map.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxScenesOpen = 3;

// "x -1 to 1 mm, Rx -7 to 7 deg"
std::string travel_of(const SceneFacts& facts) {
  std::string text;
  for (const SceneAxis& axis : facts.axes)
    text += (text.empty() ? "" : ", ") + axis.name + " " + sort_value(axis.lower) + " to " + sort_value(axis.upper) +
            " " + axis.unit;
  return text;
}

// The model of machine time.
std::string clock_text(const SceneFacts& facts) {
  std::string text;
  for (std::size_t k = 0; k < facts.clock.size(); ++k)
    if (std::isfinite(facts.clock[k]))
      text += (text.empty() ? "" : ", ") + sort_value(facts.clock[k]) + kClockParameters[k].unit;
  return text;
}

bool is_shown(const SceneFacts& facts, const std::map<std::string, std::string>& drawings) {
  return !facts.axes.empty() || drawings.count(facts.scene) > 0;
}

void drawing(HtmlWriter& html, const std::string& name, const std::string& uri) {
  html.open("figure", {{"class", "plot lens"}});
  html.empty("img", {{"src", uri}, {"alt", "Cross-section of the lens of " + name + " with rays of several fields"}});
  html.element("figcaption", "Cross-section of the nominal lens with rays of several fields.").close();
}

void landscape(HtmlWriter& html, const SceneFacts& facts, std::size_t index) {
  if (const std::optional<Figure> figure = landscape_figure(facts, index)) figure_html(html, *figure, false);
  if (!facts.plane) return;
  html.open("figure", {{"class", "plot"}});
  plane_map(html, *facts.plane);
  html.element("figcaption", "Error near the nominal pose over " + facts.plane->across.name + " and " +
                                 facts.plane->up.name +
                                 " with all other axes fixed. Along a valley the error is insensitive to the pose.");
  html.close();
}

}  // namespace

std::string scene_section(const PageModel& page, const Gallery& gallery) {
  const std::vector<SceneFacts>& scenes = page.scene_facts;
  std::size_t shown_scenes = 0;
  for (const SceneFacts& facts : scenes) shown_scenes += is_shown(facts, gallery.drawings) ? 1 : 0;
  if (shown_scenes == 0) return "";
  HtmlWriter html;
  html.element("h2", shown_scenes == 1 ? "Scene" : "Scenes");
  for (std::size_t index = 0; index < scenes.size(); ++index) {
    const SceneFacts& facts = scenes[index];
    if (!is_shown(facts, gallery.drawings)) continue;
    const std::string &name = facts.scene, &summary = facts.summary;
    html.open("details", shown_scenes <= kMaxScenesOpen ? Attributes{{"class", "scene"}, {"open", ""}}
                                                        : Attributes{{"class", "scene"}});
    html.open("summary").element("bdi", name).close();
    if (!summary.empty()) html.element("p", summary);
    std::string quiet;
    if (const std::string travel = travel_of(facts); !travel.empty()) quiet = "Travel: " + travel + ". ";
    if (facts.width > 0)
      quiet += "Images of " + std::to_string(facts.width) + " x " + std::to_string(facts.height) + " pixels. ";
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
