#include "statistics/study_aggregate.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "statistics/pooled_sample.h"

namespace relign::statistics {
namespace {

constexpr double kFailed = 1;  // a failed trial counts as if the lens had stayed at the start pose

using Columns = std::vector<std::vector<double>>;  // [stratum][instance]

// One training of a method over all strata.
struct Member {
  std::string training;
  std::vector<std::size_t> series;
  Columns last, area;
  std::vector<double> by_step;  // averaged over the strata, from step 0; empty where no stratum has a value
  std::size_t strata = 0, failed = 0;
  unsigned steps = 0;
};

struct List {
  std::string name;
  std::vector<Member> members;
};

class ProtocolAggregates {
 public:
  ProtocolAggregates(const TrialTable& table, const Study& study, std::vector<SeriesErrors>& errors,
                     const std::vector<std::vector<std::uint64_t>>& failed, const StudyOptions& options)
      : table_(table), study_(study), errors_(errors), failed_(failed), options_(options) {}

  AggregateStudy of(const std::string& protocol, Parallel& parallel) {
    AggregateStudy result;
    result.protocol = protocol;
    for (std::size_t group = 0; group < study_.groups.size(); ++group)
      if (study_.groups[group].protocol == protocol && has_ground_truth(study_.groups[group]))
        result.strata.push_back(group);
    if (result.strata.empty()) return result;
    for (const std::size_t group : result.strata) instances_.push_back(study_.groups[group].instances.size());
    std::vector<List> lists;
    for (std::size_t stratum = 0; stratum < result.strata.size(); ++stratum)
      for (const std::size_t series : study_.groups[result.strata[stratum]].series) add(lists, stratum, series);
    for (List& list : lists)
      for (Member& member : list.members)
        for (double& sum : member.by_step) sum /= static_cast<double>(member.strata);
    compute(lists, result, parallel);
    return result;
  }

 private:
  bool has_ground_truth(const GroupStudy& group) const {
    return std::any_of(group.series.begin(), group.series.end(),
                       [this](std::size_t series) { return errors_[series].known > 0; });
  }

  void add(std::vector<List>& lists, std::size_t stratum, std::size_t number) {
    const Series& series = table_.series[number];
    const std::string& name = series.method.empty() ? series.algorithm : series.method;
    auto list = std::find_if(lists.begin(), lists.end(), [&](const List& one) { return one.name == name; });
    if (list == lists.end()) list = lists.insert(lists.end(), {name, {}});
    auto found = std::find_if(list->members.begin(), list->members.end(),
                              [&](const Member& one) { return one.training == series.training; });
    if (found == list->members.end()) {
      found = list->members.insert(list->members.end(), Member());
      found->training = series.training;
      for (const std::size_t count : instances_) {
        found->last.emplace_back(count, kMissing);
        found->area.emplace_back(count, kMissing);
      }
    }
    const SeriesErrors errors = std::move(errors_[number]);
    const std::size_t with_value = errors.known + failed_[number].size();
    if (with_value == 0) return;
    found->series.push_back(number);
    ++found->strata;
    found->failed += failed_[number].size();
    found->steps = std::max(found->steps, series.largest_budget);
    const std::vector<std::uint64_t>& instances = study_.groups[group_of(number)].instances;
    const auto put = [&](std::uint64_t instance, double last, double area) {
      const auto place =
          static_cast<std::size_t>(std::lower_bound(instances.begin(), instances.end(), instance) - instances.begin());
      found->last[stratum][place] = last;
      found->area[stratum][place] = area;
    };
    for (std::size_t trial = 0; trial < series.trials.size(); ++trial)
      put(table_.rows[series.trials[trial]].instance, errors.last[trial], errors.area[trial]);
    for (const std::uint64_t instance : failed_[number]) put(instance, kFailed, kFailed);
    const std::size_t steps = std::max(found->by_step.size(), std::max<std::size_t>(1, errors.by_step.size()));
    const std::vector<double> before = found->by_step;
    found->by_step.assign(steps, 0);
    for (std::size_t step = 0; step < steps; ++step) {
      if (!before.empty()) found->by_step[step] = before[std::min(step, before.size() - 1)];
      double sum = static_cast<double>(failed_[number].size()) * kFailed;
      if (!errors.by_step.empty()) sum += errors.by_step[std::min(step, errors.by_step.size() - 1)];
      found->by_step[step] += sum / static_cast<double>(with_value);
    }
  }

  std::size_t group_of(std::size_t series) const {
    for (std::size_t group = 0; group < study_.groups.size(); ++group) {
      const std::vector<std::size_t>& here = study_.groups[group].series;
      if (std::find(here.begin(), here.end(), series) != here.end()) return group;
    }
    return study_.groups.size();
  }

  // Trainings are concatenated within each stratum.
  static StratifiedValues pooled(const std::vector<const Member*>& members, Columns Member::*columns) {
    StratifiedValues values;
    values.trainings = members.size();
    values.strata.resize((members.front()->*columns).size());
    for (const Member* member : members)
      for (std::size_t stratum = 0; stratum < values.strata.size(); ++stratum) {
        const std::vector<double>& here = (member->*columns)[stratum];
        values.strata[stratum].insert(values.strata[stratum].end(), here.begin(), here.end());
      }
    return values;
  }

  static MethodErrors errors_of(const std::vector<const Member*>& members) {
    return {pooled(members, &Member::last), pooled(members, &Member::area)};
  }

  double iqm_of(const StratifiedValues& values) const {
    const EveryOnce once(instances_, values.trainings);
    PooledSample::Scratch scratch;
    PooledStatistics statistics;
    PooledSample(values, instances_, {}).resampled(once.draw, once.trainings(), scratch, statistics);
    return statistics.iqm;
  }

  static AggregateMethod described(const std::string& name, const std::vector<const Member*>& members) {
    AggregateMethod method;
    method.name = name;
    method.strata = members.front()->strata;
    for (const Member* member : members) {
      method.series.insert(method.series.end(), member->series.begin(), member->series.end());
      method.strata = std::min(method.strata, member->strata);
      method.failed += member->failed;
      method.steps = std::max(method.steps, member->steps);
      if (!member->training.empty()) method.trainings.push_back(member->training);
      method.by_step.resize(std::max(method.by_step.size(), member->by_step.size()), 0);
    }
    for (const Member* member : members)
      for (std::size_t step = 0; step < method.by_step.size() && !member->by_step.empty(); ++step)
        method.by_step[step] +=
            member->by_step[std::min(step, member->by_step.size() - 1)] / static_cast<double>(members.size());
    return method;
  }

  std::string class_of(const AggregateMethod& method) const {
    if (method.series.empty()) return "";
    const Series& series = table_.series[method.series.front()];
    const auto found = options_.classes.find({series.algorithm, series.protocol});
    return found == options_.classes.end() ? "" : found->second;
  }

  // Indices into the first `ranked` methods, which are in the order of their rank; the better one first.
  std::vector<std::pair<std::size_t, std::size_t>> compared(const std::vector<AggregateMethod>& methods,
                                                            std::size_t ranked) const {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    std::map<std::string, std::size_t> best;  // by class
    for (std::size_t first = 0; first < ranked; ++first) {
      const bool best_of_class = best.emplace(class_of(methods[first]), first).second;
      for (std::size_t second = first + 1; second < ranked; ++second) {
        const bool wanted = first == 0 || ranked <= kMaxComparedMethods;
        const bool of_baseline = methods[first].name == options_.baseline || methods[second].name == options_.baseline;
        const bool of_class =
            options_.baseline && best_of_class && class_of(methods[first]) == class_of(methods[second]);
        if (wanted || of_baseline || of_class) pairs.emplace_back(first, second);
      }
    }
    return pairs;
  }

  void compute(std::vector<List>& lists, AggregateStudy& result, Parallel& parallel) const {
    // Methods are ordered by interquartile mean, and the order determines the compared pairs.
    struct Entry {
      AggregateMethod method;
      std::vector<MethodErrors> errors;  // of the method, then of its trainings if there are several
      double iqm = kMissing;
    };
    std::vector<Entry> entries;
    for (List& list : lists) {
      std::vector<const Member*> members;
      for (const Member& member : list.members) members.push_back(&member);
      Entry entry = {described(list.name, members), {errors_of(members)}, kMissing};
      if (entry.method.strata == result.strata.size()) entry.iqm = iqm_of(entry.errors.front().last);
      for (const Member* member : members) {
        if (member->training.empty() || std::isnan(entry.iqm)) continue;
        entry.method.members.push_back(described(member->training, {member}));
        if (members.size() > 1) entry.errors.push_back(errors_of({member}));
      }
      entries.push_back(std::move(entry));
      list.members.clear();  // values were copied: free the memory
    }
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::isnan(a.iqm) || std::isnan(b.iqm) ? !std::isnan(a.iqm) && std::isnan(b.iqm) : a.iqm < b.iqm;
    });
    std::vector<MethodErrors> wanted;
    std::vector<AggregateBands*> places;
    std::size_t ranked = 0;
    for (Entry& entry : entries) {
      result.methods.push_back(std::move(entry.method));
      if (std::isnan(entry.iqm)) continue;
      ++ranked;
      wanted.push_back(std::move(entry.errors.front()));
    }
    for (std::size_t at = 0; at < ranked; ++at) places.push_back(&result.methods[at].bands);
    for (std::size_t at = 0; at < ranked; ++at)
      for (std::size_t training = 1; training < entries[at].errors.size(); ++training) {
        wanted.push_back(std::move(entries[at].errors[training]));
        places.push_back(&result.methods[at].members[training - 1].bands);
      }
    const std::vector<std::pair<std::size_t, std::size_t>> pairs = compared(result.methods, ranked);
    const StratifiedResampling resampling(instances_, options_.resamples, options_.seed);
    Aggregates found = aggregate(resampling, wanted, pairs, parallel);
    for (std::size_t at = 0; at < places.size(); ++at) *places[at] = std::move(found.methods[at]);
    for (std::size_t at = 0; at < ranked; ++at)
      if (result.methods[at].members.size() == 1) result.methods[at].members.front().bands = result.methods[at].bands;
    result.pairs = std::move(found.pairs);
  }

  const TrialTable& table_;
  const Study& study_;
  std::vector<SeriesErrors>& errors_;
  const std::vector<std::vector<std::uint64_t>>& failed_;
  const StudyOptions& options_;
  std::vector<std::size_t> instances_;  // of each stratum
};

}  // namespace

SeriesErrors::SeriesErrors(const Series& series, Rule by)
    : rule(by), last(series.trials.size(), kMissing), area(series.trials.size(), kMissing) {
  if (!series.trials.empty()) by_step.assign(series.largest_budget + std::size_t{1}, 0);
}

void SeriesErrors::add(const ReadTrial& trial) {
  const std::vector<double> errors =
      normalised_errors(trial.steps, trial.row.own_optimum_mse, rule, trial.series.score);
  const double under = area_under(errors, std::max(trial.row.budget, static_cast<unsigned>(errors.size()) - 1));
  if (std::isnan(under) || std::isnan(errors.front())) return;
  last[trial.place] = errors.back();
  area[trial.place] = under;
  ++known;
  for (std::size_t step = 0; step < by_step.size(); ++step) by_step[step] += errors[std::min(step, errors.size() - 1)];
}

std::vector<AggregateStudy> aggregates_of(const TrialTable& table, const Study& study, std::vector<SeriesErrors> errors,
                                          const StudyOptions& options, Parallel& parallel) {
  std::vector<std::vector<std::uint64_t>> failed(table.series.size());
  for (const TrialRow& row : table.rows)
    if (!row.counts()) failed[row.series].push_back(row.instance);
  std::vector<AggregateStudy> all;
  for (const GroupStudy& group : study.groups) {
    if (std::any_of(all.begin(), all.end(), [&](const AggregateStudy& one) { return one.protocol == group.protocol; }))
      continue;
    AggregateStudy one = ProtocolAggregates(table, study, errors, failed, options).of(group.protocol, parallel);
    all.push_back(std::move(one));
  }
  all.erase(std::remove_if(all.begin(), all.end(), [](const AggregateStudy& one) { return one.strata.empty(); }),
            all.end());
  return all;
}

}  // namespace relign::statistics
