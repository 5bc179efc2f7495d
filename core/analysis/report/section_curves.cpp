// A card per group: curves drawn by the script, static figures, and the pictures of the best method.
#include "markup/html_writer.h"
#include "report/figure_html.h"
#include "report/picture_html.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxGroupsOpen = 6;
constexpr std::size_t kManyGroups = 12, kMethodsInManyGroups = 20;  // limits the size of the page

void strip(HtmlWriter& html, const Group& group, const TrialPictures& trial, const Gallery& gallery,
           const std::string& best, bool explained) {
  const bool median = trial.why == "median";
  html.open("div", {{"class", "strip"}});
  start_picture(html, gallery, trial, std::string(median ? "median trial" : "worst trial") + ": start");
  picture(html, gallery, trial.end, trial.last_capture ? "last image" : "final pose");
  if (const Frame* reference = reference_of(gallery, group)) picture(html, gallery, *reference, "reference");
  html.close();
  if (!explained) return;
  html.element("p", {{"class", "quiet"}},
               "Images of the median and the worst trial of " + best + ": at the start and " +
                   (trial.last_capture ? "at the last step (a station cannot capture the recommended pose afterwards)."
                                       : "at the final pose."));
}

void strips(HtmlWriter& html, const Group& group, const std::string& best, const Gallery& gallery) {
  if (best.empty()) return;
  const TrialPictures* median = pictures_of(gallery, group, best, "median");
  const TrialPictures* worst = pictures_of(gallery, group, best, "worst");
  if (median && worst && worst->trial == median->trial) worst = nullptr;  // a single trial
  if (median) strip(html, group, *median, gallery, best, !worst);
  if (worst) strip(html, group, *worst, gallery, best, true);
}

void plots(HtmlWriter& html, const char* summary, const std::vector<Figure>& figures, bool open) {
  if (figures.empty()) return;
  html.open("details", open ? Attributes{{"open", ""}} : Attributes{}).element("summary", summary);
  for (const Figure& figure : figures) figure_html(html, figure, false);
  html.close();
}

}  // namespace

std::string curve_cards(const PageModel& page, const Gallery& gallery) {
  HtmlWriter html;
  std::size_t index = 0;
  const bool open = page.groups.size() <= kMaxGroupsOpen;
  const std::size_t most = page.groups.size() > kManyGroups ? kMethodsInManyGroups : kMaxMethodsInFigure;
  for (const Group& group : page.groups) {
    const std::string number = std::to_string(index);
    html.open("section", {{"class", "card"}, {"id", "group-" + number}, {"data-group", number}});
    html.open("h3").element("bdi", group.label).close();
    html.element("div", {{"class", "chart"}}, "");
    html.element("p", {{"class", "readout"}, {"aria-live", "polite"}}, "");
    plots(html, "Runtime distribution (ECDF)", ecdf_figures(page, index, most), open);
    plots(html, "Residual misalignment", residual_figures(page, index, most), false);
    strips(html, group, page.verdict[index].best, gallery);
    html.close();
    ++index;
  }
  return html.take();
}

}  // namespace relign::report
