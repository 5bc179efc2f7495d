// Run status, methods and provenance.
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

void failures(HtmlWriter& html, const std::vector<Failure>& list) {
  bool any_log = false;
  html.open("div", {{"class", "scroll"}}).open("table");
  table_head(html, {"method", "trials", "message", "for example"});
  html.open("tbody");
  for (const Failure& failure : list) {
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", failure.method).close();
    html.element("td", {{"class", "number"}}, std::to_string(failure.count));
    html.element("td", {{"class", "message"}}, failure.message.empty() ? "(no message)" : failure.message)
        .open("td", {{"class", "message"}});
    std::string named;
    for (const FailedTrial& trial : failure.trials) {
      any_log = any_log || !trial.log.empty();
      named += (named.empty() ? "" : "; ") + trial.noise_level + " instance " + std::to_string(trial.instance) +
               " after " + counted(trial.steps, "step") + " (" + trial.trial + ")" +
               (trial.log.empty() ? "" : ", " + trial.log);
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

std::string ran_section(const PageModel& page, const Gallery& gallery) {
  HtmlWriter html;
  const RunState& ran = page.ran;
  html.element("h2", "Run status");
  if (ran.planned > 0 && ran.finished == ran.planned)
    html.element("p", "All planned trials finished (" + std::to_string(ran.planned) + " of " +
                          std::to_string(ran.planned) + ").");
  else if (ran.planned == 0)
    html.element("p", "No trials were planned or run.");
  else
    html.element("p", "Incomplete: of " + counted(ran.planned, "planned trial") + ", " + std::to_string(ran.finished) +
                          " finished, " + std::to_string(ran.failed) + " failed and " + std::to_string(ran.missing) +
                          " have no result" +
                          (ran.incomplete.empty()
                               ? "."
                               : " (" + std::to_string(ran.incomplete.size()) + " of these were interrupted).") +
                          (ran.missing > 0 ? " Run the same command again to resume." : ""));
  if (!page.failures.empty()) failures(html, page.failures);
  if (!ran.incomplete.empty()) {
    std::string named;
    for (std::size_t i = 0; i < ran.incomplete.size() && i < kMaxIncompleteNamed; ++i)
      named += (i > 0 ? ", " : "") + ran.incomplete[i];
    if (ran.incomplete.size() > kMaxIncompleteNamed) named += ", ...";
    html.element("p", "Interrupted trials: " + named);
  }
  if (ran.from_other_plans > 0)
    html.element("p", counted(ran.from_other_plans, "trial") +
                          " in this folder belong to an earlier plan (the suite or a plugin has changed since) and are "
                          "excluded from this page.");
  if (ran.harness) {
    const double share = ran.harness->share_of_scene_time;
    html.element("p", "Harness overhead (stage, scoring, records, communication with workers): " +
                          significant(ran.harness->microseconds_per_step) + " microseconds of wall time per step" +
                          (std::isfinite(share) ? ", " + significant(100 * share, 2) +
                                                      " % of the scene's time to capture and score the step."
                                                : "."));
  }
  if (!page.warnings.empty()) {
    html.element("p", "Warnings of plugins:").open("ul");
    for (const PluginWarning& warning : page.warnings)
      html.element("li", warning.method + ": " + warning.message +
                             (warning.count > 1 ? " (" + counted(warning.count, "time") + ")" : ""));
    html.close();
  }
  if (!gallery.problems.empty()) {
    html.element("p", "Pictures that could not be shown:").open("ul");
    for (const std::string& problem : gallery.problems) html.element("li", problem);
    html.close();
  }
  return html.take();
}

std::string methods_section(const PageModel& page) {
  if (page.methods.empty()) return "";
  HtmlWriter html;
  html.element("h2", "Methods").open("div", {{"class", "scroll"}}).open("table", {{"class", "methods"}});
  table_head(html, {"method", "description", "observes", "parameters", "reproducible", "plugin hash"});
  html.open("tbody");
  for (const Method& method : page.methods) {
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", method.label);
    if (!method.id.empty() && method.id != method.name) html.element("span", {{"class", "quiet"}}, " " + method.id);
    tag(html, method.training_tag);
    html.close();
    html.element("td", method.kind + (method.kind.empty() || method.summary.empty() ? "" : ": ") + method.summary);
    html.element("td", join(method.observes, ", ") + (method.of_class == ObservationClass::oracle ? " (oracle)" : ""));
    html.open("td");
    for (const auto& [key, value] : method.parameters.items())
      html.element("code", key + " = " + value.dump(-1, ' ', false, Json::error_handler_t::replace)).text(" ");
    html.close();
    html.element("td", method.reproducible);
    html.open("td").element("code", {{"title", method.plugin_hash}}, short_hash_of(method.plugin_hash));
    html.close().close();
  }
  return html.take();
}

namespace {

constexpr std::size_t kMaxSourcesNamed = 50;

// The source folders of a merged one, and trials that differ between them.
void merged_from(HtmlWriter& html, const Provenance& from) {
  const std::vector<Source>& sources = from.sources;
  if (sources.empty()) return;
  html.element("p", "Merged from " + counted(sources.size(), "results folder") + ".");
  if (from.disagreeing > 0) {
    html.open("p").element("strong", "Not reproducible: ");
    html.text(counted(from.disagreeing, "trial") +
              " with different results in two of these folders. Those of the first folder are used.")
        .close()
        .open("ul");
    for (const std::string& disagreement : from.disagreements) html.element("li", disagreement);
    html.close();
  }
  html.open("details").element("summary", "The folders").open("div", {{"class", "scroll"}}).open("table");
  table_head(html, {"folder", "trials", "processor", "program hash"});
  html.open("tbody");
  for (std::size_t index = 0; index < sources.size() && index < kMaxSourcesNamed; ++index) {
    const Source& source = sources[index];
    html.open("tr").open("th", {{"scope", "row"}}).element("bdi", source.folder).close();
    html.element("td", {{"class", "number"}}, std::to_string(source.trials));
    html.element("td", source.cpu);
    html.open("td").element("code", short_hash_of(source.program)).close().close();
  }
  html.close().close().close();
  if (sources.size() > kMaxSourcesNamed)
    html.element("p", "... and " + std::to_string(sources.size() - kMaxSourcesNamed) + " more; see manifest.json.");
  html.close();
}

void reproduced_by(HtmlWriter& html, const Provenance& from) {
  if (!from.command.empty())
    html.element("p", "Reproduce, or resume after an interruption:").open("pre").element("code", from.command).close();
}

// Of one folder, or of several with the same instance set.
void origin(HtmlWriter& html, const Provenance& from) {
  merged_from(html, from);
  for (const std::string& note : from.merge_notes) html.element("p", {{"class", "quiet"}}, note);
  html.open("dl");
  for (const auto& [name, value] : from.facts) fact(html, name, value);
  html.close();
  if (from.suite_text.empty()) return;
  html.open("details").element("summary", "Suite file");
  html.open("pre").element("code", from.suite_text).close().close();
}

}  // namespace

std::string provenance_section(const PageModel& page) {
  HtmlWriter html;
  html.element("h2", "Provenance");
  if (!page.parts.empty())
    html.element("p", "From folders with different instances: only methods within a group ran on the same instances.");
  reproduced_by(html, page.provenance);
  if (!page.provenance.command.empty()) {
    html.element(
        "p", {{"class", "quiet"}},
        "The same suite, program and plugins give the same numbers for any number of workers; host times differ.");
    if (any_group(page, &Group::station))
      html.element("p", {{"class", "quiet"}}, "Trials on a station are the exception: they cannot be replayed.");
  }
  if (page.parts.empty()) origin(html, page.provenance);
  for (const PagePart& part : page.parts) {
    html.open("h3").element("bdi", part.label).close();
    reproduced_by(html, part.provenance);
    origin(html, part.provenance);
  }
  html.element(
      "p", page.parts.empty() && !page.merged_for_this_page
               ? "Data files beside this page: aggregate.csv, curves.csv, curves.json, instances.csv, matrix.csv, and "
                 "every step in trials/."
               : "The results folders contain the same numbers, and every step in trials/.");
  return html.take();
}

}  // namespace relign::report
