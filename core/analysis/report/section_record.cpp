// Run status, methods and provenance.
#include "base/json_members.h"
#include "base/text.h"
#include "markup/html_writer.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxIncompleteNamed = 20;

void fact(HtmlWriter& html, const char* name, const std::string& value) {
  if (value.empty()) return;
  html.element("dt", name).open("dd").element("bdi", value).close();
}

std::string short_hash_of(const std::string& hash) { return hash.substr(0, 16); }

void failures(HtmlWriter& html, const Json& list) {
  bool any_log = false;
  html.open("div", {{"class", "scroll"}}).open("table").open("thead").open("tr");
  for (const char* title : {"method", "trials", "message", "for example"})
    html.element("th", {{"scope", "col"}}, title);
  html.close().close().open("tbody");
  for (const Json& failure : list) {
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", text_of(failure, "method")).close();
    html.element("td", {{"class", "number"}}, std::to_string(count_of(failure, "count")));
    const std::string message = text_of(failure, "message");
    html.element("td", {{"class", "message"}}, message.empty() ? "(no message)" : message)
        .open("td", {{"class", "message"}});
    std::string named;
    for (const Json& trial : failure["trials"]) {
      any_log = any_log || !text_of(trial, "log").empty();
      named += (named.empty() ? "" : "; ") + text_of(trial, "noise_level") + " instance " +
               std::to_string(count_of(trial, "instance")) + " after " + counted(count_of(trial, "steps"), "step") +
               " (" + text_of(trial, "trial") + ")" +
               (text_of(trial, "log").empty() ? "" : ", " + text_of(trial, "log"));
    }
    html.text(named).close().close();
  }
  html.close().close().close();
  if (any_log)
    html.element("p", {{"class", "quiet"}},
                 "The files logs/... in the results folder contain everything that the plugins of a trial printed and "
                 "logged.");
}

}  // namespace

std::string ran_section(const Json& data, const Gallery& gallery) {
  HtmlWriter html;
  const Json& ran = data["ran"];
  const std::uint64_t planned = count_of(ran, "planned"), finished = count_of(ran, "finished");
  html.element("h2", "Run status");
  if (planned > 0 && finished == planned)
    html.element("p",
                 "All planned trials finished (" + std::to_string(planned) + " of " + std::to_string(planned) + ").");
  else if (planned == 0)
    html.element("p", "No trials were planned or run.");
  else
    html.element("p", "Incomplete: of " + counted(planned, "planned trial") + ", " + std::to_string(finished) +
                          " finished, " + std::to_string(count_of(ran, "failed")) + " failed and " +
                          std::to_string(count_of(ran, "missing")) + " have no result" +
                          (ran["incomplete"].empty()
                               ? "."
                               : " (" + std::to_string(ran["incomplete"].size()) + " of these were interrupted).") +
                          (count_of(ran, "missing") > 0 ? " Run the same command again to resume." : ""));
  if (!data["failures"].empty()) failures(html, data["failures"]);
  if (!ran["incomplete"].empty()) {
    std::string named;
    for (std::size_t i = 0; i < ran["incomplete"].size() && i < kMaxIncompleteNamed; ++i)
      named += (i > 0 ? ", " : "") + ran["incomplete"][i].get<std::string>();
    if (ran["incomplete"].size() > kMaxIncompleteNamed) named += ", ...";
    html.element("p", "Interrupted trials: " + named);
  }
  if (count_of(ran, "from_other_plans") > 0)
    html.element("p", counted(count_of(ran, "from_other_plans"), "trial") +
                          " in this folder belong to an earlier plan (the suite or a plugin has changed since) and are "
                          "excluded from this page.");
  if (ran.contains("harness") && ran["harness"].is_object()) {
    const Json& harness = ran["harness"];
    const Json& share = harness["share_of_scene_time"];
    html.element("p", "Harness overhead (stage, scoring, records, communication with workers): " +
                          significant(harness["microseconds_per_step"].get<double>()) +
                          " microseconds of wall time per step" +
                          (share.is_number() ? ", " + significant(100 * share.get<double>(), 2) +
                                                   " % of the scene's time to capture and score the step."
                                             : "."));
  }
  if (!data["warnings"].empty()) {
    html.element("p", "Warnings of plugins:").open("ul");
    for (const Json& warning : data["warnings"])
      html.element(
          "li", text_of(warning, "method") + ": " + text_of(warning, "message") +
                    (count_of(warning, "count") > 1 ? " (" + counted(count_of(warning, "count"), "time") + ")" : ""));
    html.close();
  }
  if (!gallery.problems.empty()) {
    html.element("p", "Pictures that could not be shown:").open("ul");
    for (const std::string& problem : gallery.problems) html.element("li", problem);
    html.close();
  }
  return html.take();
}

std::string methods_section(const Json& data) {
  if (data["methods"].empty()) return "";
  HtmlWriter html;
  html.element("h2", "Methods").open("div", {{"class", "scroll"}}).open("table", {{"class", "methods"}});
  html.open("thead").open("tr");
  for (const char* title : {"method", "description", "observes", "parameters", "reproducible", "plugin hash"})
    html.element("th", {{"scope", "col"}}, title);
  html.close().close().open("tbody");
  for (const Json& method : data["methods"]) {
    const std::string name = text_of(method, "name"), id = text_of(method, "id");
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", text_of(method, "label"));
    if (!id.empty() && id != name) html.element("span", {{"class", "quiet"}}, " " + id);
    if (const std::string tag = text_of(method, "training_tag"); !tag.empty())
      html.text(" ").element("span", {{"class", "tag"}}, tag);
    html.close();
    const std::string kind = text_of(method, "kind"), summary = text_of(method, "summary");
    html.element("td", kind + (kind.empty() || summary.empty() ? "" : ": ") + summary);
    html.element("td", joined(method["observes"], ", ") + (flag_of(method, "oracle") ? " (oracle)" : ""));
    html.open("td");
    for (const auto& [key, value] : method["parameters"].items())
      html.element("code", key + " = " + value.dump(-1, ' ', false, Json::error_handler_t::replace)).text(" ");
    html.close();
    html.element("td", text_of(method, "reproducible"));
    html.open("td").element("code", {{"title", text_of(method, "plugin_hash")}},
                            short_hash_of(text_of(method, "plugin_hash")));
    html.close().close();
  }
  return html.take();
}

namespace {

constexpr std::size_t kMaxSourcesNamed = 50;
constexpr std::size_t kMaxDisagreementsNamed = 20;

// The source folders of a merged one, and trials that differ between them.
void merged_from(HtmlWriter& html, const Json& data) {
  const Json& sources = list_of(data, "sources");
  if (sources.empty()) return;
  const Json& merge = object_of(data, "merge");
  html.element("p", "Merged from " + counted(sources.size(), "results folder") + ".");
  if (const std::uint64_t differing = count_of(merge, "disagreeing"); differing > 0) {
    html.open("p").element("strong", "Not reproducible: ");
    html.text(counted(differing, "trial") +
              " with different results in two of these folders. Those of the first folder are used.")
        .close()
        .open("ul");
    std::size_t named = 0;
    for (const Json& one : list_of(merge, "disagreements")) {
      if (++named > kMaxDisagreementsNamed) break;
      const Json& difference = object_of(one, "difference");
      html.element(
          "li",
          text_of(one, "label") + ": " +
              (text_of(difference, "line") == "closing" ? "the closing line" : "step " + text_of(difference, "step")) +
              ", " + text_of(difference, "field") + " is " + text_of(difference, "kept") + " in " +
              text_of(one, "kept") + ", " + text_of(difference, "other") + " in " + text_of(one, "other"));
    }
    html.close();
  }
  html.open("details").element("summary", "The folders").open("div", {{"class", "scroll"}}).open("table");
  html.open("thead").open("tr");
  for (const char* title : {"folder", "trials", "processor", "program hash"})
    html.element("th", {{"scope", "col"}}, title);
  html.close().close().open("tbody");
  for (std::size_t index = 0; index < sources.size() && index < kMaxSourcesNamed; ++index) {
    const Json& source = sources[index];
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", text_of(source, "folder")).close();
    html.element("td", {{"class", "number"}}, text_of(source, "trials"));
    html.element("td", text_of(source, "cpu"));
    html.open("td").element("code", short_hash_of(text_of(source, "program"))).close().close();
  }
  html.close().close().close();
  if (sources.size() > kMaxSourcesNamed)
    html.element("p", "... and " + std::to_string(sources.size() - kMaxSourcesNamed) + " more; see manifest.json.");
  html.close();
}

void reproduced_by(HtmlWriter& html, const Json& part) {
  const std::string command = text_of(part, "command");
  if (!command.empty())
    html.element("p", "Reproduce, or resume after an interruption:").open("pre").element("code", command).close();
}

// Of one folder, or of several with the same instance set.
void origin(HtmlWriter& html, const Json& part) {
  merged_from(html, part);
  for (const Json& note : list_of(part, "merge_notes"))
    if (note.is_string()) html.element("p", {{"class", "quiet"}}, note.get<std::string>());
  const Json &program = object_of(part, "program"), &machine = object_of(part, "machine");
  html.open("dl");
  fact(html, "program", "relign-bench " + text_of(program, "version"));
  fact(html, "program hash", text_of(program, "hash"));
  fact(html, "compiler", text_of(program, "compiler"));
  fact(html, "flags", text_of(program, "flags"));
  fact(html, "processor", text_of(machine, "cpu"));
  fact(html, "cores", text_of(machine, "cores"));
  fact(html, "system", text_of(machine, "system"));
  fact(html, "suite file", text_of(part, "suite_file"));
  fact(html, "suite seed", text_of(part, "seed"));
  fact(html, "instance set", text_of(part, "instance_set"));
  html.close();
  const std::string suite = text_of(part, "suite_text");
  if (suite.empty()) return;
  html.open("details").element("summary", "Suite file");
  html.open("pre").element("code", suite).close().close();
}

}  // namespace

std::string provenance_section(const Json& data) {
  HtmlWriter html;
  html.element("h2", "Provenance");
  const Json& parts = list_of(data, "parts");
  if (!parts.empty())
    html.element("p", "From folders with different instances: only methods within a group ran on the same instances.");
  reproduced_by(html, data);
  if (!text_of(data, "command").empty()) {
    html.element(
        "p", {{"class", "quiet"}},
        "The same suite, program and plugins give the same numbers for any number of workers; host times differ.");
    if (any_group(data, "station"))
      html.element("p", {{"class", "quiet"}}, "Trials on a station are the exception: they cannot be replayed.");
  }
  if (parts.empty()) origin(html, data);
  for (const Json& part : parts) {
    html.open("h3").element("bdi", text_of(part, "label")).close();
    reproduced_by(html, part);
    origin(html, part);
  }
  html.element(
      "p", parts.empty() && !flag_of(data, "merged_for_this_page")
               ? "Data files beside this page: aggregate.csv, curves.csv, curves.json, instances.csv, and every step "
                 "in trials/."
               : "The results folders contain the same numbers, and every step in trials/.");
  return html.take();
}

}  // namespace relign::report
