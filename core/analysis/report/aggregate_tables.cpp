// The aggregates as CSV and Markdown.
#include <array>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/escape.h"
#include "report/aggregate_data.h"

namespace relign::report {
namespace {

constexpr std::array kStatistics = {"iqm", "median", "gap", "area"};

std::string field(const Json& object, const std::string& key) {
  const Json& value = member(object, key.c_str());
  return value.is_number() ? shortest(value.get<double>()) : "";
}

std::string csv_row(const Json& entry, const Json& method, const Json& numbers, const std::string& training,
                    std::uint64_t trainings, const Json& best) {
  std::string row = csv_field(text_of(entry, "protocol")) + ',' + csv_field(text_of(method, "method")) + ',' +
                    csv_field(training) + ',' + csv_field(text_of(method, "class")) + ',' +
                    (flag_of(method, "oracle") ? "true" : "false") + ',' + std::to_string(trainings) + ',' +
                    (text_of(method, "training_tag").empty() ? "false" : "true") + ',' +
                    std::to_string(count_of(method, "strata")) + ',' + field(numbers, "n") + ',' +
                    std::to_string(count_of(numbers, "failed")) + ',' + std::to_string(count_of(method, "steps"));
  for (const std::string statistic : kStatistics)
    for (const char* end : {"", "_lo95", "_hi95"}) row += ',' + field(numbers, statistic + end);
  const Json& spread = training.empty() ? object_of(method, "spread") : object_of(Json(), "");
  for (const char* key : {"lowest", "highest", "sd"}) row += ',' + field(spread, key);
  for (const char* key : {"improvement", "lo95", "hi95"}) row += ',' + field(best, key);
  return row + '\n';
}

std::string interval_text(const Json& numbers, const std::string& statistic) {
  const Json& value = member(numbers, statistic.c_str());
  if (!value.is_number()) return "-";
  std::string text = significant(value.get<double>(), 3);
  const Json &low = member(numbers, (statistic + "_lo95").c_str()),
             &high = member(numbers, (statistic + "_hi95").c_str());
  if (low.is_number() && high.is_number())
    text += " (" + significant(low.get<double>(), 3) + " - " + significant(high.get<double>(), 3) + ")";
  return text;
}

}  // namespace

std::string aggregate_csv(const Json& data) {
  std::string csv = "protocol,algorithm,training,class,oracle,trainings,trained,strata,n,failed,steps";
  for (const std::string statistic : kStatistics)
    csv += ',' + statistic + ',' + statistic + "_lo95," + statistic + "_hi95";
  csv +=
      ",iqm_lowest_training,iqm_highest_training,iqm_sd_of_trainings,best_improves,best_improves_lo95,best_improves_"
      "hi95\n";
  for (const Json& entry : list_of(data, "aggregate")) {
    const std::string best = entry["methods"].empty() ? "" : text_of(entry["methods"].front(), "method");
    for (const Json& method : entry["methods"]) {
      const Json* against = nullptr;
      for (const Json& pair : entry["pairs"])
        if (text_of(pair, "a") == best && text_of(pair, "b") == text_of(method, "method")) against = &pair;
      const Json& trainings = list_of(method, "trainings");
      csv += csv_row(entry, method, method, "", std::max<std::size_t>(1, trainings.size()),
                     against ? *against : object_of(Json(), ""));
      for (const Json& training : trainings)
        csv += csv_row(entry, method, training, text_of(training, "training"), 1, object_of(Json(), ""));
    }
  }
  return csv;
}

std::string aggregate_markdown(const Json& data) {
  std::string out;
  for (const Json& entry : list_of(data, "aggregate")) {
    out +=
        "**All scenes and noise levels, protocol " + markdown_text(text_of(entry, "protocol")) +
        "**: normalised error after the last step (0: the instance's own optimum, 1: no better than the start), with "
        "95 % intervals, over " +
        std::to_string(entry["strata"].size()) +
        (entry["strata"].size() == 1 ? " stratum" : " strata of equal weight") +
        ".\n\n| method | observes | IQM | median | optimality gap | area under the error curve | failed |\n"
        "|---|---|---|---|---|---|---:|\n";
    for (const Json& method : entry["methods"]) {
      std::string name = markdown_text(text_of(method, "method"));
      if (flag_of(method, "oracle")) name += " (oracle)";
      if (const std::string tag = text_of(method, "training_tag"); !tag.empty())
        name += " (" + markdown_text(tag) + ")";
      if (count_of(method, "n") == 0)
        name += " (results in " + std::to_string(count_of(method, "strata")) + " of " +
                std::to_string(entry["strata"].size()) + " strata)";
      out += "| " + name + " | " + text_of(method, "class") + " |";
      for (const std::string statistic : kStatistics) out += " " + interval_text(method, statistic) + " |";
      out += " " + std::to_string(count_of(method, "failed")) + " |\n";
    }
    for (const Json& method : entry["methods"])
      if (const Json& spread = object_of(method, "spread"); !spread.empty())
        out += "\n" + markdown_text(text_of(method, "method")) + ": IQM of " +
               std::to_string(method["trainings"].size()) + " trainings " +
               significant(spread["lowest"].get<double>(), 3) + " to " +
               significant(spread["highest"].get<double>(), 3) + ", standard deviation " +
               significant(spread["sd"].get<double>(), 2) + ".\n";
    out += "\n";
  }
  return out;
}

}  // namespace relign::report
