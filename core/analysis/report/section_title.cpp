// The head of the page: title, badges, what was compared, quality gates and the verdict.
#include <algorithm>
#include <map>

#include "base/json_members.h"
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
void gate_badges(HtmlWriter& html, const Json& data) {
  for (const Json& gate : list_of(data, "gates")) {
    const bool ok = flag_of(gate, "ok");
    if (ok && text_of(gate, "name") == "ran") continue;  // has a badge of its own
    html.element("span", {{"class", ok ? "badge good" : "badge bad"}, {"title", text_of(gate, "text")}},
                 ok ? "ok " + text_of(gate, "text") : "FAILED " + text_of(gate, "name"))
        .text(" ");
  }
}

void failed_gates(HtmlWriter& html, const Json& data) {
  const Json& gates = list_of(data, "gates");
  if (std::all_of(gates.begin(), gates.end(), [](const Json& gate) { return flag_of(gate, "ok"); })) return;
  html.open("div", {{"class", "broken"}, {"role", "alert"}});
  html.element("p", "Failed checks; do not rely on these results:").open("ul");
  for (const Json& gate : gates)
    if (!flag_of(gate, "ok"))
      html.open("li").element("b", text_of(gate, "name")).text(": " + text_of(gate, "text")).close();
  html.close().close();
}

}  // namespace

std::string title_section(const Json& data) {
  HtmlWriter html;
  const Json& ran = data["ran"];
  const std::uint64_t planned = count_of(ran, "planned"), finished = count_of(ran, "finished"),
                      failed = count_of(ran, "failed"), missing = count_of(ran, "missing");
  const std::string name = text_of(data, "suite_name");
  html.open("h1").element("bdi", name.empty() ? "Unnamed results" : name).close();
  html.open("p", {{"class", "badges"}});
  badge(html, finished == planned && planned > 0 ? "good" : "bad",
        planned == 0 ? "no trials" : std::to_string(finished) + "/" + std::to_string(planned) + " trials ran");
  std::map<std::string, std::uint64_t> failures;  // by method
  for (const Json& failure : data["failures"]) failures[text_of(failure, "method")] += count_of(failure, "count");
  for (const auto& [method, count] : failures) badge(html, "bad", std::to_string(count) + " failed: " + method);
  if (missing > 0) badge(html, "bad", counted(missing, "trial") + " not finished");
  gate_badges(html, data);
  html.close();
  if (data["groups"].empty()) {
    html.element("p", {{"class", "facts"}},
                 planned > 0 ? "No trial of this run has finished yet; there is nothing to compare."
                             : "This results folder contains no trials; there is nothing to compare.");
    return html.take();
  }
  const Json& steps = data["steps"];
  const std::string range = steps[0] == steps[1] ? steps[1].dump() : steps[0].dump() + " to " + steps[1].dump();
  const std::string levels = (data["noise_levels"].size() == 1 ? " \u00b7 noise level " : " \u00b7 noise levels ") +
                             joined(data["noise_levels"], ", ");
  html.element("p", {{"class", "facts"}},
               joined(data["scenes"], ", ") + (every_group(data, "station") ? "" : levels) + " \u00b7 " +
                   (list_of(data, "parts").empty() ? counted(count_of(data, "instances"), "instance") + " each"
                                                   : counted(data["parts"].size(), "instance set")) +
                   " \u00b7 protocol " + joined(data["protocols"], " and ") + " \u00b7 " + range + " steps" +
                   (failed + missing == 0 ? "" : " \u00b7 incomplete"));
  if (const std::string spec = text_of(data, "spec_text"); !spec.empty())
    html.open("p", {{"class", "facts"}}).text("Specification: ").element("bdi", spec).close();
  html.open("p", {{"class", "intro"}});
  html.text("Which method aligns the lens best? ");
  if (!every_group(data, "station"))
    html.text(std::string(list_of(data, "parts").empty() ? "All" : "Within a folder, all") +
              " methods were given the same instances, which are draws of manufacturing errors, start pose and stage "
              "errors. "
              "Each step is one move and one image. ");
  if (any_group(data, "station"))
    html.text(
        "On a hardware station, lens, start pose and stage are real. All methods requested the same lenses, with one "
        "move and one image per step, but the harness cannot check that the station supplied them. ");
  html.element("b", "Error");
  if (!every_group(data, "measured_only"))
    html.text(std::string(" is the RMSE between the reference image and the image of the lens fixed at ") +
              rule_text(text_of(data, "rule")) + ", without camera noise; lower is better, 0 is identical.");
  if (any_group(data, "measured_only"))
    html.text(std::string(every_group(data, "measured_only") ? "" : " marked \u201cmeasured only\u201d") +
              " is the lowest measured RMSE between an image and the reference, camera noise included, since there is "
              "no ground truth.");
  html.close();
  return html.take();
}

std::string verdict_section(const Json& data) {
  HtmlWriter html;
  failed_gates(html, data);
  if (!data["verdict"].empty()) {
    html.element("h2", "Verdict").open("ul", {{"class", "verdict"}});
    // The sentence starts with the name of the best method.
    const auto sentence = [&html](const Json& of) {
      const std::string best = text_of(of, "best"), text = text_of(of, "text");
      if (!best.empty()) html.element("b", best);
      html.text(text.substr(best.size())).close();
    };
    for (const Json& entry : data["verdict"]) {
      html.open("li").element("b", {{"class", "label"}}, text_of(entry, "label")).text(": ");
      const Json& classes = list_of(entry, "classes");
      if (classes.empty()) {
        sentence(entry);
        continue;
      }
      html.text(text_of(entry, "rest")).open("ul");
      for (const Json& one : classes) {
        html.open("li").text(text_of(one, "title") + ": ");
        sentence(one);
      }
      html.close().close();
    }
    html.close();
  }
  if (const std::string note = text_of(data, "rules_note"); !note.empty())
    html.element("p", {{"class", "facts"}}, note);
  HtmlWriter rest;
  if (!data["caveats"].empty()) {
    rest.open("ul", {{"class", "caveats"}});
    for (const Json& text : data["caveats"]) rest.element("li", text.get<std::string>());
    rest.close();
  }
  return html.take() + analysis_section(data) + rest.take();
}

}  // namespace relign::report
