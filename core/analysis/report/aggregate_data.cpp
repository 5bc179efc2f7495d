#include "report/aggregate_data.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/json_members.h"
#include "base/text.h"
#include "markup/escape.h"

namespace relign::report {
namespace {

statistics::AggregateBands shown_bands(statistics::AggregateBands bands) {
  for (statistics::Band* band : {&bands.iqm, &bands.median, &bands.gap, &bands.area}) *band = shown(*band);
  for (statistics::Band& band : bands.profile) band = shown(band);
  return bands;
}

// Variation between the trainings of a method.
AggregateMethod::Spread spread_of(const std::vector<statistics::AggregateMethod>& members) {
  double lowest = INFINITY, highest = -INFINITY, sum = 0, squares = 0;
  for (const statistics::AggregateMethod& member : members) {
    const double iqm = member.bands.iqm.estimate;
    lowest = std::min(lowest, iqm);
    highest = std::max(highest, iqm);
    sum += iqm;
  }
  const auto count = static_cast<double>(members.size());
  for (const statistics::AggregateMethod& member : members)
    squares += (member.bands.iqm.estimate - sum / count) * (member.bands.iqm.estimate - sum / count);
  return {shown(lowest), shown(highest), shown(std::sqrt(squares / (count - 1)))};
}

AggregateMethod aggregate_method(const statistics::AggregateMethod& from) {
  AggregateMethod method;
  method.method = from.name;
  method.strata = from.strata;
  method.failed = from.failed;
  method.steps = from.steps;
  if (from.bands.iqm.n == 0) return method;
  method.bands = shown_bands(from.bands);
  method.by_step = shown(from.by_step);
  for (const statistics::AggregateMethod& member : from.members)
    method.trainings.push_back({member.name, member.failed, shown_bands(member.bands)});
  if (from.members.size() > 1) method.spread = spread_of(from.members);
  return method;
}

}  // namespace

const AggregatePair* Aggregate::pair_of(const std::string& a, const std::string& b) const {
  for (const AggregatePair& pair : pairs)
    if (pair.a == a && pair.b == b) return &pair;
  return nullptr;
}

std::vector<Aggregate> aggregates_of(const LoadedResults& results, const statistics::Study& study,
                                     const std::vector<Method>& methods) {
  const std::map<std::string, std::string> tags = training_tags(results.manifest);
  const std::map<std::string, std::string> lists = training_lists(results.manifest);
  std::map<std::pair<std::string, std::string>, ObservationClass> classes;  // by method and protocol
  for (const Method& method : methods) {
    const auto list = lists.find(method.name);
    classes[{list == lists.end() ? method.name : list->second, method.protocol}] = method.of_class;
  }

  std::vector<Aggregate> all;
  for (const statistics::AggregateStudy& one : study.aggregates) {
    Aggregate entry;
    entry.protocol = one.protocol;
    for (const std::size_t group : one.strata) {
      const statistics::GroupStudy& stratum = study.groups[group];
      entry.strata.push_back({stratum.scene, stratum.noise_level, stratum.instances.size()});
    }
    for (const statistics::AggregateMethod& from : one.methods) {
      AggregateMethod method = aggregate_method(from);
      if (const auto tag = tags.find(from.name); tag != tags.end()) method.training_tag = tag->second;
      if (const auto found = classes.find({from.name, one.protocol}); found != classes.end())
        method.of_class = found->second;
      entry.methods.push_back(std::move(method));
    }
    for (const statistics::Improvement& pair : one.pairs)
      entry.pairs.push_back({one.methods[pair.first].name, one.methods[pair.second].name, shown(pair.share)});
    all.push_back(std::move(entry));
  }
  return all;
}

namespace {

struct AggregateColumn {
  const char* name;
  statistics::Band statistics::AggregateBands::*band;
};
constexpr std::array kAggregateColumns = {AggregateColumn{"iqm", &statistics::AggregateBands::iqm},
                                          AggregateColumn{"median", &statistics::AggregateBands::median},
                                          AggregateColumn{"gap", &statistics::AggregateBands::gap},
                                          AggregateColumn{"area", &statistics::AggregateBands::area}};

std::string fields(const statistics::Band& band) {
  return ',' + sort_value(band.estimate) + ',' + sort_value(band.interval.low) + ',' + sort_value(band.interval.high);
}

std::string csv_row(const Aggregate& entry, const AggregateMethod& method, const std::string& training,
                    std::size_t trainings, std::size_t failed, const statistics::AggregateBands& bands) {
  std::string row = csv_field(entry.protocol) + ',' + csv_field(method.method) + ',' + csv_field(training) + ',' +
                    csv_field(class_name(method.of_class)) + ',' + (method.oracle() ? "true" : "false") + ',' +
                    std::to_string(trainings) + ',' + (method.training_tag.empty() ? "false" : "true") + ',' +
                    std::to_string(method.strata) + ',' +
                    (bands.iqm.n > 0 ? shortest(static_cast<double>(bands.iqm.n)) : "") + ',' + std::to_string(failed) +
                    ',' + std::to_string(method.steps);
  for (const AggregateColumn& column : kAggregateColumns) row += fields(bands.*column.band);
  return row;
}

std::string band_text(const statistics::Band& band) {
  const std::string interval = interval_text(band.interval, 3, " - ");
  return number_text(band.estimate, 3) + (interval.empty() ? "" : " (" + interval + ")");
}

}  // namespace

std::string aggregate_csv(const PageModel& page) {
  std::string csv = "protocol,algorithm,training,class,oracle,trainings,trained,strata,n,failed,steps";
  for (const AggregateColumn& column : kAggregateColumns)
    csv += std::string(",") + column.name + ',' + column.name + "_lo95," + column.name + "_hi95";
  csv +=
      ",iqm_lowest_training,iqm_highest_training,iqm_sd_of_trainings,best_improves,best_improves_lo95,best_improves_"
      "hi95\n";
  for (const Aggregate& entry : page.aggregates)
    for (const AggregateMethod& method : entry.methods) {
      const AggregatePair* against = entry.pair_of(entry.methods.front().method, method.method);
      const AggregateMethod::Spread spread = method.spread.value_or(AggregateMethod::Spread());
      csv +=
          csv_row(entry, method, "", std::max<std::size_t>(1, method.trainings.size()), method.failed, method.bands) +
          ',' + sort_value(spread.lowest) + ',' + sort_value(spread.highest) + ',' + sort_value(spread.sd) +
          fields(against ? against->improvement : statistics::Band()) + '\n';
      for (const AggregateTraining& training : method.trainings)
        csv += csv_row(entry, method, training.name, 1, training.failed, training.bands) + ",,,,,,\n";
    }
  return csv;
}

std::string aggregate_markdown(const PageModel& page) {
  const SceneWords words = common_words(page);
  std::string out;
  for (const Aggregate& entry : page.aggregates) {
    out += "**All scenes and noise levels, protocol " + markdown_text(entry.protocol) +
           "**: normalised error after the last step (0: the instance's optimum, 1: no better than the start), with "
           "95 % intervals, over " +
           std::to_string(entry.strata.size()) + (entry.strata.size() == 1 ? " stratum" : " strata of equal weight") +
           ".\n\n| method | observes | IQM | median | optimality gap | area under the error curve | failed |\n"
           "|---|---|---|---|---|---|---:|\n";
    for (const AggregateMethod& method : entry.methods) {
      std::string name = markdown_text(method.method);
      if (method.oracle()) name += " (oracle)";
      if (!method.training_tag.empty()) name += " (" + markdown_text(method.training_tag) + ")";
      if (!method.has_numbers())
        name +=
            " (results in " + std::to_string(method.strata) + " of " + std::to_string(entry.strata.size()) + " strata)";
      out += "| " + name + " | " + words.observed(class_name(method.of_class)) + " |";
      for (const AggregateColumn& column : kAggregateColumns) out += " " + band_text(method.bands.*column.band) + " |";
      out += " " + std::to_string(method.failed) + " |\n";
    }
    for (const AggregateMethod& method : entry.methods)
      if (method.spread)
        out += "\n" + markdown_text(method.method) + ": IQM of " + std::to_string(method.trainings.size()) +
               " training runs " + significant(method.spread->lowest, 3) + " to " +
               significant(method.spread->highest, 3) + ", standard deviation " + significant(method.spread->sd, 2) +
               ".\n";
    out += "\n";
  }
  return out;
}

}  // namespace relign::report
