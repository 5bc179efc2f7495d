// What belongs to one group or scene: cards with curves and figures, films, pictures of trials, scenes.
#include <algorithm>

#include "base/text.h"
#include "report/json_put.h"
#include "report/picture_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxGroupsOpen = 6, kMaxScenesOpen = 3;
constexpr std::size_t kManyGroups = 12, kMethodsInManyGroups = 20;  // limits the size of the page
constexpr std::size_t kMaxMethodsNamed = 12;                        // without pictures

constexpr const char* kWhys[] = {"median", "worst", "best"};
constexpr int kPoseDigits = 4, kReplayDigits = 3;

Json pose_json(const std::vector<double>& pose) {
  Json list = Json::array();
  for (const double value : pose) list.push_back(rounded(value, kPoseDigits));
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

void strip(PageWriter& out, const Group& group, const TrialPictures& trial, const Gallery& gallery,
           const std::string& best, bool explained) {
  out.open("strip");
  start_picture(out.html(), gallery, trial, std::string(trial.why == "median" ? "median" : "worst") + " trial: start");
  picture(out.html(), gallery, trial.end, trial.last_capture ? "last image" : "final pose");
  if (const Frame* reference = reference_of(gallery, group)) picture(out.html(), gallery, *reference, "reference");
  out.close();
  if (explained)
    out.text("Images of the median and the worst trial of " + best + ": at the start and " +
                 (trial.last_capture ? "at the last step (a station cannot capture the recommended pose afterwards)."
                                     : "at the final pose."),
             "quiet");
}

void strips(PageWriter& out, const Group& group, const std::string& best, const Gallery& gallery) {
  if (best.empty()) return;
  const TrialPictures* median = pictures_of(gallery, group, best, "median");
  const TrialPictures* worst = pictures_of(gallery, group, best, "worst");
  if (median && worst && worst->trial == median->trial) worst = nullptr;  // a single trial
  if (median) strip(out, group, *median, gallery, best, !worst);
  if (worst) strip(out, group, *worst, gallery, best, true);
}

void plots(PageWriter& out, const char* summary, const std::vector<Figure>& figures, bool open) {
  if (figures.empty()) return;
  out.unfold(summary, "", open);
  for (const Figure& figure : figures) out.chart(figure);
  out.close();
}

// "5 um/s (x, y)": the speeds that axes have of their own.
std::vector<std::string> own_speeds(const std::vector<SceneAxis>& axes) {
  std::vector<std::pair<std::string, std::string>> found;  // speed, axes
  for (const SceneAxis& axis : axes) {
    if (!(axis.speed_per_s > 0)) continue;
    const std::string speed = sort_value(axis.speed_per_s) + (axis.unit.empty() ? "" : " ") + axis.unit + "/s";
    const auto same = std::find_if(found.begin(), found.end(), [&](const auto& one) { return one.first == speed; });
    if (same == found.end())
      found.emplace_back(speed, axis.name);
    else
      same->second += ", " + axis.name;
  }
  std::vector<std::string> words;
  for (const auto& [speed, names] : found) words.push_back(speed + " (" + names + ")");
  return words;
}

// "Travel: x -1 to 1 mm. Images of ... Simulated machine time: ..."
std::string facts_text(const SceneFacts& facts) {
  std::string travel;
  for (const SceneAxis& axis : facts.axes)
    travel += (travel.empty() ? "" : ", ") + axis.name + " " + sort_value(axis.lower) + " to " +
              sort_value(axis.upper) + " " + axis.unit;
  std::vector<std::string> clock;
  for (std::size_t k = 0; k < facts.clock.size(); ++k)
    if (std::isfinite(facts.clock[k])) clock.push_back(sort_value(facts.clock[k]) + kClockParameters[k].unit);
  if (!clock.empty()) {  // it is simulated
    const std::vector<std::string> speeds = own_speeds(facts.axes);
    clock.insert(clock.begin(), speeds.begin(), speeds.end());
  }
  return (travel.empty() ? "" : "Travel: " + travel + ". ") +
         (facts.readings.empty() ? "" : "Readings: " + join(facts.readings, ", ") + ". ") +
         (facts.width == 0
              ? ""
              : "Images of " + std::to_string(facts.width) + " x " + std::to_string(facts.height) + " pixels. ") +
         (clock.empty() ? "" : "Simulated machine time: " + join(clock, ", ") + ".");
}

bool is_shown(const SceneFacts& facts, const Gallery& gallery) {
  return !facts.axes.empty() || gallery.drawings.count(facts.scene) > 0;
}

void plane_map(PageWriter& out, const SceneFacts& facts) {
  const LandscapePlane& plane = *facts.plane;
  const auto axis = [](const LandscapePlane::Axis& of) {
    return Json{{"name", of.name}, {"unit", of.unit}, {"values", of.values}};
  };
  out.chart("error-map-" + facts.scene,
            "Error near the nominal pose over " + plane.across.name + " and " + plane.up.name +
                " with all other axes fixed. Along a valley the error is insensitive to the pose.",
            {{"title", "Error near the nominal pose, " + facts.scene},
             {"map",
              {{"across", axis(plane.across)},
               {"up", axis(plane.up)},
               {"rmse", plane.score},
               {"score", facts.scored_by.label()}}}});
}

}  // namespace

void curve_cards(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  const bool open = page.groups.size() <= kMaxGroupsOpen;
  const std::size_t most = page.groups.size() > kManyGroups ? kMethodsInManyGroups : kMaxMethodsInFigure;
  for (std::size_t index = 0; index < page.groups.size(); ++index) {
    out.open("card", "group-" + std::to_string(index));
    out.heading(3, Words{{page.groups[index].label, "name"}}).open("chart").close();
    plots(out, "Runtime distribution (ECDF)", ecdf_figures(page, index, most), open);
    plots(out, "Residual misalignment", residual_figures(page, index, most), false);
    strips(out, page.groups[index], page.verdict[index].best, parts.gallery);
    out.close();
  }
}

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
    for (const records::FilmFrame& frame : trial.film.frames)
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

void film_strips(PageWriter& out, const PageParts& parts) {
  const auto& [page, gallery, rmse] = parts;
  std::size_t shown = 0, missing = 0, last_group = page.groups.size();
  each_film(page, gallery, [&](std::size_t group, const TrialPictures& trial) {
    if (!trial.film.picture) {
      ++missing;
      return;
    }
    if (shown++ == 0) out.unfold("All film strips", "film-strips", true);
    if (group != last_group) out.heading(3, Words{{parts.page.groups[group].label, "name"}});
    last_group = group;
    const std::string what = ", " + trial.why + " trial (instance " + std::to_string(trial.instance) + ")";
    out.open("film-line").text({{trial.algorithm, "name"}, {what}}, "caption");
    film_strip(out.html(), parts.gallery, trial.film, trial.algorithm + what);
    out.close();
  });
  if (shown > 0) out.close();
  if (missing > 0) out.text(counted(missing, "film") + " omitted; see pictures/<trial>/film.webp.", "quiet");
}

void scene_section(PageWriter& out, const PageParts& parts) {
  const auto& [page, gallery, rmse] = parts;
  std::size_t shown = 0;
  for (const SceneFacts& facts : page.scene_facts) shown += is_shown(facts, gallery) ? 1 : 0;
  if (shown == 0) return;
  out.heading(2, shown == 1 ? "Scene" : "Scenes");
  for (std::size_t index = 0; index < page.scene_facts.size(); ++index) {
    const SceneFacts& facts = page.scene_facts[index];
    if (!is_shown(facts, gallery)) continue;
    out.unfold(Words{{facts.scene, "name"}}, "scene", shown <= kMaxScenesOpen);
    if (!facts.summary.empty()) out.text(facts.summary);
    if (const std::string words = facts_text(facts); !words.empty()) out.text(words, "quiet");
    out.open("figures");
    if (const auto found = gallery.drawings.find(facts.scene); found != gallery.drawings.end())
      lens_drawing(out.html(), facts.scene, found->second);
    if (const std::optional<Figure> figure = landscape_figure(facts, index)) out.chart(*figure);
    if (facts.plane) plane_map(out, facts);
    out.close().close();
  }
}

// Images of each method's best, median and worst trial.
void gallery_section(PageWriter& out, const PageParts& parts) {
  const auto& [page, gallery, rmse] = parts;
  const auto reads_only = [](const Group& group) { return group.words.capture == "reading"; };
  if (every_group(page, reads_only)) return;
  out.heading(2, "Pictures");
  if (gallery.trials.empty()) {
    out.text("This results folder contains no pictures.");
    return;
  }
  out.text(std::string("Images at the start and ") +
           (every_group(page, &Group::station) ? "after" : "at the pose recommended after") +
           " the last step of each method's best, median and worst trial, camera noise included.");
  if (any_group(page, &Group::station))
    out.text(
        "On a station nothing can be captured afterwards: images are the first and last capture of the trial, and "
        "errors are the lowest measured ones.",
        "quiet");
  if (gallery.left_out > 0)
    out.text(
        counted(gallery.left_out, "picture") + " omitted to limit the size of this page; see the files in pictures/.",
        "quiet");
  for (const Group& group : page.groups) {
    out.unfold(group.label, "gallery");
    if (const Frame* reference = reference_of(gallery, group)) picture(out.html(), gallery, *reference, "reference");
    for (const Row& row : group.rows) {
      if (!pictures_of(gallery, group, row.method, "median") && group.rows.size() > kMaxMethodsNamed) continue;
      out.open("method").heading(4, Words{{row.method, "name"}});
      bool any = false;
      for (const char* why : {"best", "median", "worst"}) {
        const TrialPictures* trial = pictures_of(gallery, group, row.method, why);
        if (!trial) continue;
        any = true;
        std::string caption = std::string(why) + ": instance " + std::to_string(trial->instance);
        if (const auto value = rmse.find(trial->trial); value != rmse.end())
          caption += (group.measured_only ? ", measured error " : ", error ") + significant(value->second, 3);
        out.open("trial").text(Words{{caption, "", "trial " + trial->trial}}, "caption").open("pair");
        start_picture(out.html(), gallery, *trial, "start");
        picture(out.html(), gallery, trial->end, "after " + counted(trial->end.step, "step"));
        out.close().close();
      }
      if (!any) out.text("no pictures", "quiet");
      out.close();
    }
    out.close();
  }
}

}  // namespace relign::report
