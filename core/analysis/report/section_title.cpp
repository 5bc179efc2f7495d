// The head of the page: title, badges, what was compared, quality gates and the verdict.
#include <algorithm>
#include <map>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/rules_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

void badge(HtmlWriter& html, const char* kind, const std::string& text) {
  html.element("span", {{"class", std::string("badge ") + kind}}, text).text(" ");
}

// One badge per gate; failed gates are also explained before the verdict.
void gate_badges(HtmlWriter& html, const PageModel& page) {
  for (const QualityGate& gate : page.gates) {
    if (gate.ok && gate.name == "ran") continue;  // has a badge of its own
    html.element("span", {{"class", gate.ok ? "badge good" : "badge bad"}, {"title", gate.text}},
                 gate.ok ? "ok " + gate.text : "FAILED " + gate.name)
        .text(" ");
  }
}

void failed_gates(HtmlWriter& html, const PageModel& page) {
  const std::vector<QualityGate>& gates = page.gates;
  if (std::all_of(gates.begin(), gates.end(), [](const QualityGate& gate) { return gate.ok; })) return;
  html.open("div", {{"class", "broken"}, {"role", "alert"}});
  html.element("p", "Failed checks; do not rely on these results:").open("ul");
  for (const QualityGate& gate : gates)
    if (!gate.ok) html.open("li").element("b", gate.name).text(": " + gate.text).close();
  html.close().close();
}

}  // namespace

std::string title_section(const PageModel& page) {
  HtmlWriter html;
  const RunState& ran = page.ran;
  html.open("h1").element("bdi", page.title.empty() ? "Unnamed results" : page.title).close();
  html.open("p", {{"class", "badges"}});
  badge(html, ran.finished == ran.planned && ran.planned > 0 ? "good" : "bad",
        ran.planned == 0 ? "no trials"
                         : std::to_string(ran.finished) + "/" + std::to_string(ran.planned) + " trials ran");
  std::map<std::string, std::size_t> failures;  // by method
  for (const Failure& failure : page.failures) failures[failure.method] += failure.count;
  for (const auto& [method, count] : failures) badge(html, "bad", std::to_string(count) + " failed: " + method);
  if (ran.missing > 0) badge(html, "bad", counted(ran.missing, "trial") + " not finished");
  gate_badges(html, page);
  html.close();
  if (page.groups.empty()) {
    html.element("p", {{"class", "facts"}},
                 ran.planned > 0 ? "No trial of this run has finished yet; there is nothing to compare."
                                 : "This results folder contains no trials; there is nothing to compare.");
    return html.take();
  }
  const PageModel::StepRange steps = page.steps.value_or(PageModel::StepRange());
  const std::string range =
      (steps.least == steps.most ? "" : std::to_string(steps.least) + " to ") + std::to_string(steps.most);
  const std::string levels = (page.noise_levels.size() == 1 ? " \u00b7 noise level " : " \u00b7 noise levels ") +
                             join(page.noise_levels, ", ");
  html.element("p", {{"class", "facts"}},
               join(page.scenes, ", ") + (every_group(page, &Group::station) ? "" : levels) + " \u00b7 " +
                   (page.parts.empty() ? counted(page.instances, "instance") + " each"
                                       : counted(page.parts.size(), "instance set")) +
                   " \u00b7 protocol " + join(page.protocols, " and ") + " \u00b7 " + range + " steps" +
                   (ran.failed + ran.missing == 0 ? "" : " \u00b7 incomplete"));
  if (!page.spec_text.empty())
    html.open("p", {{"class", "facts"}}).text("Specification: ").element("bdi", page.spec_text).close();
  html.open("p", {{"class", "intro"}});
  html.text("Which method aligns the lens best? ");
  if (!every_group(page, &Group::station))
    html.text(std::string(page.parts.empty() ? "All" : "Within a folder, all") +
              " methods were given the same instances, which are draws of manufacturing errors, start pose and stage "
              "errors. "
              "Each step is one move and one image. ");
  if (any_group(page, &Group::station))
    html.text(
        "On a hardware station, lens, start pose and stage are real. All methods requested the same lenses, with one "
        "move and one image per step, but the harness cannot check that the station supplied them. ");
  html.element("b", "Error");
  if (!every_group(page, &Group::measured_only))
    html.text(std::string(" is the RMSE between the reference image and the image of the lens fixed at ") +
              rule_text(page.rule) + ", without camera noise; lower is better, 0 is identical.");
  if (any_group(page, &Group::measured_only))
    html.text(std::string(every_group(page, &Group::measured_only) ? "" : " marked \u201cmeasured only\u201d") +
              " is the lowest measured RMSE between an image and the reference, camera noise included, since there is "
              "no ground truth.");
  html.close();
  return html.take();
}

std::string verdict_section(const PageModel& page) {
  HtmlWriter html;
  failed_gates(html, page);
  if (!page.verdict.empty()) {
    html.element("h2", "Verdict").open("ul", {{"class", "verdict"}});
    // The sentence starts with the name of the best method.
    const auto sentence = [&html](const std::string& best, const std::string& text) {
      if (!best.empty()) html.element("b", best);
      html.text(text.substr(best.size())).close();
    };
    for (const GroupVerdict& verdict : page.verdict) {
      html.open("li").element("b", {{"class", "label"}}, verdict.label).text(": ");
      if (verdict.classes.empty()) {
        sentence(verdict.best, verdict.text);
        continue;
      }
      html.text(verdict.rest).open("ul");
      for (const ClassVerdict& one : verdict.classes) {
        html.open("li").text(class_title(one.of_class) + ": ");
        sentence(one.best, one.text);
      }
      html.close().close();
    }
    html.close();
  }
  if (!page.rules_note.empty()) html.element("p", {{"class", "facts"}}, page.rules_note);
  HtmlWriter rest;
  if (!page.caveats.empty()) {
    rest.open("ul", {{"class", "caveats"}});
    for (const std::string& text : page.caveats) rest.element("li", text);
    rest.close();
  }
  return html.take() + analysis_section(page) + rest.take();
}

}  // namespace relign::report
