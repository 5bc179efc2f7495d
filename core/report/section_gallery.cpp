// Curve cards (the script draws into them) and the pictures.
#include <map>

#include "base/json_members.h"
#include "base/text.h"
#include "report/html_writer.h"
#include "report/sections.h"

namespace relign::report {
namespace {

// A picture by reference to its definition, so that pictures seen in several places are embedded once.
void picture(HtmlWriter& html, const Gallery& gallery, const Frame& frame, const std::string& what) {
  html.open("figure", {{"class", "picture"}});
  if (frame.picture) {
    const Picture& shown = gallery.pictures[*frame.picture];
    html.open("svg", {{"viewBox", "0 0 " + std::to_string(shown.width) + " " + std::to_string(shown.height)},
                      {"role", "img"},
                      {"aria-label", what}});
    html.empty("use", {{"href", "#picture-" + std::to_string(*frame.picture)}}).close();
  } else {
    html.element("div", {{"class", "nopicture"}}, frame.file.empty() ? "no picture" : "see " + frame.file);
  }
  html.element("figcaption", what).close();
}

bool same_group(const TrialPictures& trial, const Json& group) {
  return trial.scene == text_of(group, "scene") && trial.noise_level == text_of(group, "noise_level") &&
         trial.protocol == text_of(group, "protocol");
}

const TrialPictures* find(const Gallery& gallery, const Json& group, const std::string& method, const char* why) {
  for (const TrialPictures& trial : gallery.trials)
    if (trial.why == why && trial.algorithm == method && same_group(trial, group)) return &trial;
  return nullptr;
}

const Frame* reference_of(const Gallery& gallery, const Json& group) {
  const auto found = gallery.references.find(text_of(group, "scene"));
  return found == gallery.references.end() ? nullptr : &found->second;
}

void strip(HtmlWriter& html, const Json& group, const std::string& best, const Gallery& gallery) {
  const TrialPictures* trial = best.empty() ? nullptr : find(gallery, group, best, "median");
  if (!trial) return;
  html.open("div", {{"class", "strip"}});
  picture(html, gallery, trial->start, "start");
  picture(html, gallery, trial->end, trial->last_capture ? "last capture" : "recommended");
  if (const Frame* reference = reference_of(gallery, group)) picture(html, gallery, *reference, "reference");
  html.close();
  html.element("p", {{"class", "quiet"}},
               "What the sensor saw in a middling case, the median trial of " + best + " (instance " +
                   std::to_string(trial->instance) + "): before, and " +
                   (trial->last_capture ? "at its last step. A station cannot show the recommended pose afterwards."
                                        : "where it would glue."));
}

}  // namespace

std::string curve_cards(const Json& data, const Gallery& gallery) {
  HtmlWriter html;
  std::size_t index = 0;
  for (const Json& group : data["groups"]) {
    html.open("section", {{"class", "card"}, {"data-group", std::to_string(index)}});
    html.open("h3").element("bdi", text_of(group, "label")).close();
    html.element("div", {{"class", "chart"}}, "");
    html.element("p", {{"class", "readout"}, {"aria-live", "polite"}}, "");
    strip(html, group, text_of(data["verdict"][index], "best"), gallery);
    html.close();
    ++index;
  }
  return html.take();
}

std::string picture_definitions(const Gallery& gallery) {
  if (gallery.pictures.empty()) return "";
  HtmlWriter html;
  html.open("svg", {{"class", "definitions"}, {"width", "0"}, {"height", "0"}, {"aria-hidden", "true"}}).open("defs");
  for (std::size_t i = 0; i < gallery.pictures.size(); ++i)
    html.empty("image", {{"id", "picture-" + std::to_string(i)},
                         {"width", std::to_string(gallery.pictures[i].width)},
                         {"height", std::to_string(gallery.pictures[i].height)},
                         {"href", gallery.pictures[i].data_uri}});
  return html.take();
}

std::string gallery_section(const Json& data, const Gallery& gallery, const std::map<std::string, double>& rmse) {
  HtmlWriter html;
  if (data["groups"].empty()) return "";
  html.element("h2", "Pictures");
  if (gallery.trials.empty()) {
    html.element("p", "This results folder holds no pictures.");
    return html.take();
  }
  html.element("p", std::string("What the sensor saw at the start and ") +
                        (every_group(data, "station") ? "after" : "at the pose recommended after") +
                        " the last step, for each method's best, median and worst trial. Camera noise included.");
  if (any_group(data, "station"))
    html.element("p", {{"class", "quiet"}},
                 "A station's pictures are the trial's own first and last capture, and errors below them are the "
                 "lowest measured ones: nothing can be captured again.");
  if (gallery.left_out > 0)
    html.element(
        "p", {{"class", "quiet"}},
        counted(gallery.left_out, "picture") + " left out to keep this page small; the files lie in pictures/.");
  for (const Json& group : data["groups"]) {
    html.open("details", {{"class", "gallery"}}).element("summary", text_of(group, "label"));
    if (const Frame* reference = reference_of(gallery, group)) picture(html, gallery, *reference, "reference");
    for (const Json& row : group["rows"]) {
      const std::string method = text_of(row, "method");
      html.open("div", {{"class", "method"}}).open("h4").element("bdi", method).close();
      bool any = false;
      for (const char* why : {"best", "median", "worst"}) {
        const TrialPictures* trial = find(gallery, group, method, why);
        if (!trial) continue;
        any = true;
        html.open("div", {{"class", "trial"}});
        std::string caption = std::string(why) + ": instance " + std::to_string(trial->instance);
        const auto value = rmse.find(trial->trial);
        if (value != rmse.end())
          caption +=
              (flag_of(group, "measured_only") ? ", measured error " : ", error ") + significant(value->second, 3);
        html.element("p", {{"class", "caption"}, {"title", "trial " + trial->trial}}, caption);
        html.open("div", {{"class", "pair"}});
        picture(html, gallery, trial->start, "start");
        picture(html, gallery, trial->end, "after " + counted(trial->end.step, "step"));
        html.close().close();
      }
      if (!any) html.element("p", {{"class", "quiet"}}, "no pictures");
      html.close();
    }
    html.close();
  }
  return html.take();
}

}  // namespace relign::report
