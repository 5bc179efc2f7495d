// Trial replay: the images of a trial, step by step. Film strips without scripts; replay.js turns them into a viewer.

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/picture_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr const char* kWhys[] = {"median", "worst", "best"};
constexpr int kReplayDigits = 5;

Json pose_json(const std::vector<double>& pose) {
  Json list = Json::array();
  for (const double value : pose) list.push_back(rounded(value, kReplayDigits));
  return list;
}

Json picture_json(const Gallery& gallery, const Frame& frame) {
  if (!frame.picture) return nullptr;
  const Picture& picture = gallery.pictures[*frame.picture];
  return {{"picture", *frame.picture}, {"width", picture.width}, {"height", picture.height}};
}

template <typename Each>
void each_film(const PageModel& page, const Gallery& gallery, const Each& each) {
  for (std::size_t i = 0; i < page.groups.size(); ++i)
    for (const Row& row : page.groups[i].rows)
      for (const char* why : kWhys)
        if (const TrialPictures* trial = pictures_of(gallery, page.groups[i], row.method, why);
            trial && !trial->film.frames.empty())
          each(i, *trial);
}

}  // namespace

// Frames are arrays in the order that replay.js names.
Json replay_data(const PageModel& page, const Gallery& gallery) {
  Json trials = Json::array(), references = Json::object(), axes = Json::object();
  for (const auto& [scene, reference] : gallery.references) references[scene] = picture_json(gallery, reference);
  for (const auto& [scene, list] : gallery.axes) {
    axes[scene] = Json::array();
    for (const SceneAxis& axis : list) axes[scene].push_back({axis.name, axis.unit, axis.lower, axis.upper});
  }
  each_film(page, gallery, [&](std::size_t group, const TrialPictures& trial) {
    if (!trial.film.picture) return;
    Json frames = Json::array();
    for (const FilmFrame& frame : trial.film.frames)
      frames.push_back(
          Json::array({frame.step, pose_json(frame.commanded_pose), pose_json(frame.true_pose),
                       rounded(frame.measured, kReplayDigits), rounded(frame.commanded, kReplayDigits),
                       rounded(frame.recommended, kReplayDigits), rounded(frame.machine_seconds, kReplayDigits)}));
    trials.push_back({{"group", group},
                      {"scene", trial.scene},
                      {"method", trial.algorithm},
                      {"why", trial.why},
                      {"trial", trial.trial},
                      {"instance", trial.instance},
                      {"picture", *trial.film.picture},
                      {"tile", trial.film.tile},
                      {"frames", std::move(frames)},
                      {"end", picture_json(gallery, trial.end)},
                      {"end_step", trial.end.step}});
  });
  return {{"trials", std::move(trials)}, {"references", std::move(references)}, {"axes", std::move(axes)}};
}

std::string replay_section(const PageModel& page, const Gallery& gallery) {
  HtmlWriter html;
  std::size_t shown = 0, missing = 0, last_group = page.groups.size();
  each_film(page, gallery, [&](std::size_t group, const TrialPictures& trial) {
    if (!trial.film.picture) {
      ++missing;
      return;
    }
    if (shown++ == 0) html.open("details", {{"id", "film-strips"}, {"open", ""}}).element("summary", "All film strips");
    if (group != last_group) html.open("h3").element("bdi", page.groups[group].label).close();
    last_group = group;
    const std::string what =
        trial.algorithm + ", " + trial.why + " trial (instance " + std::to_string(trial.instance) + ")";
    html.open("div", {{"class", "film-line"}}).open("p", {{"class", "caption"}}).element("bdi", trial.algorithm);
    html.text(", " + trial.why + " trial (instance " + std::to_string(trial.instance) + ")").close();
    film_strip(html, gallery, trial.film, what);
    html.close();
  });
  if (shown == 0 && missing == 0) return "";
  if (shown > 0) html.close();
  if (missing > 0)
    html.element("p", {{"class", "quiet"}}, counted(missing, "film") + " omitted; see pictures/<trial>/film.webp.");
  return html.take();
}

}  // namespace relign::report
