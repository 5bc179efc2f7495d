// The first screen: one sentence, the error against images, a table of verdicts. The rest unfolds.
#include <algorithm>
#include <map>

#include "base/text.h"
#include "report/rules_data.h"
#include "report/sections.h"
#include "report/verdict.h"

namespace relign::report {
namespace {

constexpr std::size_t kFirstRows = 24;  // of the table; the ranking has further groups
constexpr std::size_t kNamed = 3;       // methods that one is better than

// One badge per gate; failed gates are also explained before the verdict.
Words badges(const PageModel& page) {
  const RunState& ran = page.ran;
  Words words;
  const auto badge = [&words](bool good, const std::string& text, const std::string& hint = "") {
    words.add(text, good ? "badge good" : "badge bad", hint).add(" ");
  };
  badge(ran.finished == ran.planned && ran.planned > 0,
        ran.planned == 0 ? "no trials"
                         : std::to_string(ran.finished) + "/" + std::to_string(ran.planned) + " trials ran");
  std::map<std::string, std::size_t> failures;  // by method
  for (const Failure& failure : page.failures) failures[failure.method] += failure.count;
  for (const auto& [method, count] : failures) badge(false, std::to_string(count) + " failed: " + method);
  if (ran.missing > 0) badge(false, counted(ran.missing, "trial") + " not finished");
  for (const QualityGate& gate : page.gates)
    if (!gate.ok || gate.name != "ran")  // which has a badge of its own
      badge(gate.ok, gate.ok ? "ok " + gate.text : "FAILED " + gate.name, gate.text);
  return words;
}

std::string compared_words(const PageModel& page) {
  const RunState& ran = page.ran;
  const PageModel::StepRange steps = page.steps.value_or(PageModel::StepRange());
  const std::string range =
      (steps.least == steps.most ? "" : std::to_string(steps.least) + " to ") + std::to_string(steps.most);
  const std::string levels = (page.noise_levels.size() == 1 ? " \u00b7 noise level " : " \u00b7 noise levels ") +
                             join(page.noise_levels, ", ");
  return join(page.scenes, ", ") + (every_group(page, &Group::station) ? "" : levels) + " \u00b7 " +
         (page.parts.empty() ? counted(page.instances, "instance") + " each"
                             : counted(page.parts.size(), "instance set")) +
         " \u00b7 protocol " + join(page.protocols, " and ") + " \u00b7 " + range + " steps" +
         (ran.failed + ran.missing == 0 ? "" : " \u00b7 incomplete");
}

Words introduction(const PageModel& page) {
  const SceneScore score = common_score(page);
  const SceneWords scene = common_words(page);
  Words words = score.squared ? "Which method aligns the lens best? " : "Which method aligns best? ";
  if (!every_group(page, &Group::station))
    words.add(std::string(page.parts.empty() ? "All" : "Within a folder, all") +
              " methods were given the same instances, which are draws of manufacturing errors, start pose and stage "
              "errors. Each step is one move and one " +
              scene.capture + ". ");
  if (any_group(page, &Group::station))
    words.add("On a hardware station, " + scene.device +
              ", start pose and stage are real. All methods requested the same " + scene.devices +
              ", with one move and one " + scene.capture +
              " per step, but the harness cannot check that the station supplied them. ");
  words.add("Error", "strong");
  if (!every_group(page, &Group::measured_only))
    words.add((score.squared
                   ? std::string(" is the RMSE between the reference image and the image of the lens fixed at ")
                   : " is the " + score.label() + " of the device fixed at ") +
              rule_text(page.rule) +
              (score.squared ? ", without camera noise; lower is better, 0 is identical."
                             : ", without noise; lower is better."));
  if (any_group(page, &Group::measured_only))
    words.add(std::string(every_group(page, &Group::measured_only) ? "" : " marked \u201cmeasured only\u201d") +
              " is the lowest measured " + score.label() +
              (score.squared ? " between an image and the reference, camera noise included" : ", noise included") +
              ", since there is no ground truth.");
  return words;
}

Cell better_cell(const VerdictRow& of) {
  if (of.compared == 0) return no_cell("words");
  const std::size_t count = of.better_than.size();
  if (count == 0) return {"none", "0", "words quiet"};
  std::vector<std::string> named = of.better_than;
  std::string text = count == of.compared && count > 1 ? "all " + std::to_string(count) : "";
  if (text.empty()) {
    named.resize(std::min(named.size(), kNamed));
    text = join(named, ", ") + (count > kNamed ? " and " + std::to_string(count - kNamed) + " more" : "");
  }
  return {Words{{text, "name"}}, std::to_string(count), "words", join(of.better_than, ", ")};
}

// Of the first groups.
Table verdict_table(const PageModel& page, std::size_t groups) {
  const bool spec = any_row(page, &Row::yield), times = any_row(page, &Row::to_spec);
  Table table{"verdicts ranking", "", {{"method", "", "The name given in the suite", "name"}}};
  if (spec)
    table.heads.push_back({"in spec", "of instances (95 %)", "Yield at the final pose; failed trials miss", "number"});
  else
    table.heads.push_back({"error", common_score(page).label() + ", median (95 %)",
                           "At the final pose; quartiles without an interval", "number"});
  const SceneWords words = common_words(page);
  table.heads.push_back(
      {words.counts(), times ? "to spec" : "in all",
       times ? "Moves, each with " + words.a_capture() + ", until the specification is met; median" : "Step budget",
       "number"});
  table.heads.push_back({"seconds", times ? "to spec" : "in all",
                         times ? "Machine time until then, median" : "Machine time of a trial, median", "number"});
  table.heads.push_back({"better than", "same class",
                         "Methods that observe the same and have a larger error on the same instances: the whole 95 % "
                         "interval of the error ratio is beyond the smallest relevant ratio",
                         "words"});
  for (std::size_t index = 0; index < groups; ++index) {
    const Group& group = page.groups[index];
    const std::vector<VerdictRow> rows = verdict_rows(group);
    if (page.groups.size() > 1)
      table.add_title(Words{{group.label, "name", "", "#group-" + std::to_string(index)}}, "group");
    const bool classes = classes_in(group.rows).size() > 1;
    for (const VerdictRow& of : rows) {
      const Row& row = *of.row;
      Cell method = method_cell(row.method, row.oracle(), "");
      if (classes && !row.oracle()) method.words.add(" ").add(group.words.observed(class_name(row.of_class)), "quiet");
      const bool never = row.to_spec && std::isinf(row.to_spec->steps);
      table.add(
          {std::move(method),
           spec ? share_cell(row.yield ? row.yield->share : kMissing,
                             row.yield ? row.yield->interval : statistics::Interval())
                : error_cell(row),
           times ? (never ? arrival_cell(row.to_spec->steps, {}) : moves_cell(row))
                 : number_cell(static_cast<double>(row.step), 6),
           times ? number_cell(row.to_spec ? row.to_spec->seconds : kMissing, 3) : number_cell(row.machine_seconds, 3),
           better_cell(of)},
          row.oracle()                             ? "oracle"
          : row.method == page.verdict[index].best ? "best"
                                                   : "");
    }
  }
  return table;
}

void first_screen(PageWriter& out, const PageModel& page) {
  out.text(headline(page), "headline").open("first").first_chart().open("first-table");
  std::size_t shown = 0, rows = 0;
  while (shown < page.groups.size() && (shown == 0 || rows + page.groups[shown].rows.size() <= kFirstRows))
    rows += page.groups[shown++].rows.size();
  out.table(verdict_table(page, shown));
  if (shown < page.groups.size())
    out.text(Words{{"The ranking has all " + std::to_string(page.groups.size()) + " groups.", "", "", "#ranking"}},
             "quiet");
  out.close().close();
}

// A sentence that begins with the name of the best method.
Words sentence(Words words, const std::string& best, const std::string& text) {
  return words.add(best, "strong").add(text.substr(best.size()));
}

}  // namespace

void title_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  out.heading(1, Words{{page.title.empty() ? "Unnamed results" : page.title, "name"}}).text(badges(page), "badges");
  if (page.groups.empty())
    out.text(page.ran.planned > 0 ? "No trial of this run has finished yet; there is nothing to compare."
                                  : "This results folder contains no trials; there is nothing to compare.",
             "facts");
  else
    out.text(compared_words(page) + (page.spec_text.empty() ? "" : " \u00b7 specification: " + page.spec_text),
             "facts");
}

void verdict_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  std::vector<Words> failed;
  for (const QualityGate& gate : page.gates)
    if (!gate.ok) failed.push_back(Words{{gate.name, "strong"}, {": " + gate.text}});
  if (!failed.empty()) out.open("broken").text("Failed checks; do not rely on these results:").list(failed).close();
  if (!page.verdict.empty()) {
    first_screen(out, page);
    out.unfold("The verdict in sentences", "sentences").heading(2, "Verdict");
    std::vector<Words> verdicts;
    for (const GroupVerdict& verdict : page.verdict) {
      const Words label = {{verdict.label, "label"}, {": "}};
      if (verdict.classes.empty()) verdicts.push_back(sentence(label, verdict.best, verdict.text));
      for (const ClassVerdict& one : verdict.classes)
        verdicts.push_back(sentence(Words(label).add(one.title + ": "), one.best, one.text));
      if (!verdict.rest.empty()) verdicts.push_back(Words(label).add(verdict.rest));
    }
    out.list(verdicts, "verdict");
    if (!page.rules_note.empty()) out.text(page.rules_note, "facts");
    out.close();
  }
  analysis_section(out, parts);
  if (!page.caveats.empty() || !page.groups.empty()) {
    out.unfold("What was compared, and caveats", "sentences");
    if (!page.groups.empty()) out.text(introduction(page), "intro");
    std::vector<Words> caveats(page.caveats.begin(), page.caveats.end());
    out.list(caveats, "caveats").close();
  }
}

}  // namespace relign::report
