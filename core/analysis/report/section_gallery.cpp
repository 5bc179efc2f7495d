// Images of each method's best, median and worst trial.
#include <map>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/picture_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxMethodsNamed = 12;  // without pictures

}  // namespace

std::string gallery_section(const PageModel& page, const Gallery& gallery, const std::map<std::string, double>& rmse) {
  HtmlWriter html;
  if (page.groups.empty()) return "";
  html.element("h2", "Pictures");
  if (gallery.trials.empty()) {
    html.element("p", "This results folder contains no pictures.");
    return html.take();
  }
  html.element("p", std::string("Images at the start and ") +
                        (every_group(page, &Group::station) ? "after" : "at the pose recommended after") +
                        " the last step of each method's best, median and worst trial, camera noise included.");
  if (any_group(page, &Group::station))
    html.element(
        "p", {{"class", "quiet"}},
        "On a station nothing can be captured afterwards: images are the first and last capture of the trial, and "
        "errors are the lowest measured ones.");
  if (gallery.left_out > 0)
    html.element(
        "p", {{"class", "quiet"}},
        counted(gallery.left_out, "picture") + " omitted to limit the size of this page; see the files in pictures/.");
  for (const Group& group : page.groups) {
    html.open("details", {{"class", "gallery"}}).element("summary", group.label);
    if (const Frame* reference = reference_of(gallery, group)) picture(html, gallery, *reference, "reference");
    for (const Row& row : group.rows) {
      const std::string& method = row.method;
      const bool none = !pictures_of(gallery, group, method, "median");
      if (none && group.rows.size() > kMaxMethodsNamed) continue;
      html.open("div", {{"class", "method"}}).open("h4").element("bdi", method).close();
      bool any = false;
      for (const char* why : {"best", "median", "worst"}) {
        const TrialPictures* trial = pictures_of(gallery, group, method, why);
        if (!trial) continue;
        any = true;
        html.open("div", {{"class", "trial"}});
        std::string caption = std::string(why) + ": instance " + std::to_string(trial->instance);
        const auto value = rmse.find(trial->trial);
        if (value != rmse.end())
          caption += (group.measured_only ? ", measured error " : ", error ") + significant(value->second, 3);
        html.element("p", {{"class", "caption"}, {"title", "trial " + trial->trial}}, caption);
        html.open("div", {{"class", "pair"}});
        start_picture(html, gallery, *trial, "start");
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
