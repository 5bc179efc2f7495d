#include "report/aggregate_data.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/json_members.h"

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
  std::map<std::string, std::string> lists;  // from display name to method with several trainings
  for (const Json& entry : list_of(results.manifest, "algorithms"))
    if (const Json& list = object_of(entry, "of_list"); !list.empty())
      lists[text_of(entry, "name")] = text_of(list, "method");
  std::map<std::pair<std::string, std::string>, ObservationClass> classes;  // by method and protocol
  for (const Method& method : methods)
    classes[{lists.count(method.name) ? lists[method.name] : method.name, method.protocol}] = method.of_class;

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

}  // namespace relign::report
