// Run status, methods and provenance.
#include "base/text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxIncompleteNamed = 20, kMaxSourcesNamed = 50;

Cell hash_cell(const std::string& hash) { return {Words{{hash.substr(0, 16), "code", hash}}}; }

void failures(PageWriter& out, const std::vector<Failure>& list) {
  bool any_log = false;
  Table table{"", "", {{"method"}, {"trials"}, {"message"}, {"for example"}}};
  table.sortable = false;
  for (const Failure& failure : list) {
    std::string named;
    for (const FailedTrial& trial : failure.trials) {
      any_log = any_log || !trial.log.empty();
      named += (named.empty() ? "" : "; ") + trial.noise_level + " instance " + std::to_string(trial.instance) +
               " after " + counted(trial.steps, "step") + " (" + trial.trial + ")" +
               (trial.log.empty() ? "" : ", " + trial.log);
    }
    table.add({method_cell(failure.method, false, ""),
               number_cell(std::to_string(failure.count)),
               {failure.message.empty() ? "(no message)" : failure.message, std::nullopt, "message"},
               {named, std::nullopt, "message"}});
  }
  out.table(table);
  if (any_log)
    out.text(
        "The files logs/... in the results folder contain everything that the plugins of a trial printed and logged.",
        "quiet");
}

std::string status_text(const RunState& ran) {
  if (ran.planned == 0) return "No trials were planned or run.";
  if (ran.finished == ran.planned)
    return "All planned trials finished (" + std::to_string(ran.planned) + " of " + std::to_string(ran.planned) + ").";
  return "Incomplete: of " + counted(ran.planned, "planned trial") + ", " + std::to_string(ran.finished) +
         " finished, " + std::to_string(ran.failed) + " failed and " + std::to_string(ran.missing) + " have no result" +
         (ran.incomplete.empty() ? "."
                                 : " (" + std::to_string(ran.incomplete.size()) + " of these were interrupted).") +
         (ran.missing > 0 ? " Run the same command again to resume." : "");
}

}  // namespace

void ran_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  const RunState& ran = page.ran;
  out.heading(2, "Run status").text(status_text(ran));
  if (!page.failures.empty()) failures(out, page.failures);
  if (!ran.incomplete.empty()) {
    std::vector<std::string> named = ran.incomplete;
    if (named.size() > kMaxIncompleteNamed) {
      named.resize(kMaxIncompleteNamed);
      named.emplace_back("...");
    }
    out.text("Interrupted trials: " + join(named, ", "));
  }
  if (ran.from_other_plans > 0)
    out.text(
        counted(ran.from_other_plans, "trial") +
        " in this folder belong to an earlier plan (the suite or a plugin has changed since) and are excluded from "
        "this page.");
  if (ran.harness) {
    const double share = ran.harness->share_of_scene_time;
    out.text("Harness overhead (stage, scoring, records, communication with workers): " +
             significant(ran.harness->microseconds_per_step) + " microseconds of wall time per step" +
             (std::isfinite(share)
                  ? ", " + significant(100 * share, 2) + " % of the scene's time to capture and score the step."
                  : "."));
  }
  std::vector<Words> warnings;
  for (const PluginWarning& warning : page.warnings)
    warnings.emplace_back(warning.method + ": " + warning.message +
                          (warning.count > 1 ? " (" + counted(warning.count, "time") + ")" : ""));
  if (!warnings.empty()) out.text("Warnings of plugins:").list(warnings);
  if (!parts.gallery.problems.empty())
    out.text("Pictures that could not be shown:").list({parts.gallery.problems.begin(), parts.gallery.problems.end()});
}

void methods_section(PageWriter& out, const PageParts& parts) {
  if (parts.page.methods.empty()) return;
  Table table{
      "methods", "", {{"method"}, {"description"}, {"observes"}, {"parameters"}, {"reproducible"}, {"plugin hash"}}};
  table.sortable = false;
  for (const Method& method : parts.page.methods) {
    Cell name = method_cell(method.label, false, "");
    if (!method.id.empty() && method.id != method.name) name.words.add(" " + method.id, "quiet");
    if (!method.training_tag.empty()) name.words.add(" ").add(method.training_tag, "tag");
    Words parameters;
    for (const auto& [key, value] : method.parameters.items())
      parameters.add(key + " = " + value.dump(-1, ' ', false, Json::error_handler_t::replace), "code").add(" ");
    table.add({std::move(name),
               {method.kind + (method.kind.empty() || method.summary.empty() ? "" : ": ") + method.summary},
               {common_words(parts.page).observed(join(method.observes, ", ")) +
                (method.of_class == ObservationClass::oracle ? " (oracle)" : "")},
               {std::move(parameters)},
               {method.reproducible},
               hash_cell(method.plugin_hash)});
  }
  out.heading(2, "Methods").table(table);
}

namespace {

// The source folders of a merged one, and trials that differ between them.
void merged_from(PageWriter& out, const Provenance& from) {
  const std::vector<Source>& sources = from.sources;
  if (sources.empty()) return;
  out.text("Merged from " + counted(sources.size(), "results folder") + ".");
  if (from.disagreeing > 0)
    out.text({{"Not reproducible: ", "strong"},
              {counted(from.disagreeing, "trial") +
               " with different results in two of these folders. Those of the first folder are used."}})
        .list({from.disagreements.begin(), from.disagreements.end()});
  Table table{"", "", {{"folder"}, {"trials"}, {"processor"}, {"program hash"}}};
  table.sortable = false;
  for (std::size_t index = 0; index < sources.size() && index < kMaxSourcesNamed; ++index)
    table.add({method_cell(sources[index].folder, false, ""),
               number_cell(std::to_string(sources[index].trials)),
               {sources[index].cpu},
               hash_cell(sources[index].program)});
  out.unfold("The folders").table(table);
  if (sources.size() > kMaxSourcesNamed)
    out.text("... and " + std::to_string(sources.size() - kMaxSourcesNamed) + " more; see manifest.json.");
  out.close();
}

void reproduced_by(PageWriter& out, const Provenance& from) {
  if (!from.command.empty()) out.text("Reproduce, or resume after an interruption:").code(from.command);
}

// Of one folder, or of several with the same instance set.
void origin(PageWriter& out, const Provenance& from) {
  merged_from(out, from);
  for (const std::string& note : from.notes) out.text(note, "quiet");
  std::vector<std::pair<std::string, Words>> facts;
  for (const auto& [name, value] : from.facts) facts.emplace_back(name, Words{{value, "name"}});
  out.facts(facts);
  if (!from.suite_text.empty()) out.unfold("Suite file").code(from.suite_text).close();
}

}  // namespace

void provenance_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  out.heading(2, "Provenance");
  if (!page.parts.empty())
    out.text("From folders with different instances: only methods within a group ran on the same instances.");
  reproduced_by(out, page.provenance);
  if (!page.provenance.command.empty()) {
    out.text("The same suite, program and plugins give the same numbers for any number of workers; host times differ.",
             "quiet");
    if (any_group(page, &Group::station))
      out.text("Trials on a station are the exception: they cannot be replayed.", "quiet");
  }
  if (page.parts.empty()) origin(out, page.provenance);
  for (const PagePart& part : page.parts) {
    out.heading(3, Words{{part.label, "name"}});
    reproduced_by(out, part.provenance);
    origin(out, part.provenance);
  }
  out.text(page.parts.empty() && !page.merged_for_this_page
               ? "Data files beside this page: aggregate.csv, curves.csv, curves.json, instances.csv, matrix.csv, and "
                 "every step in trials/."
               : "The results folders contain the same numbers, and every step in trials/.");
}

}  // namespace relign::report
