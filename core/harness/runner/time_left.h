// Estimates how long a run still takes from the trials that have ended, in this run or an earlier one, and until a
// method has one, from the first captures of its running trials. The first trial of a method on a worker, and the first
// trial of an instance there, take longer than the others, so these are counted apart. A method that has not run yet is
// expected to take as long as others for a capture, since some move only once. Reads no clock.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "records/record.h"

namespace relign::runner {

// Seconds until the last trial ends.
struct Outlook {
  double seconds = 0;
  double least = 0, most = 0;  // where `seconds` probably is
};

// Where the time of a trial went, in seconds.
struct SpentTime {
  double total = 0;  // from its start to its end, with mounting
  double steps = 0;  // of these, in its steps
  double once = 0;   // of these, in a single step that looks like a preparation for later trials too
  double captures = 1;
};

// `total`: from the trial's start to its end.
SpentTime spent_time(const records::TrialTimes& times, double total);

class TimeLeft {
 public:
  struct Trial {
    std::size_t scene = 0;
    std::size_t method = 0;  // trials of one method on one scene share a number
    double captures = 1;     // at most
  };
  // `trials`: of the whole plan. `groups`: those to run, as for TrialQueue.
  TimeLeft(std::vector<Trial> trials, std::vector<std::vector<std::size_t>> groups, std::size_t workers);

  // A trial of this method in an earlier run, whose `total` may be unknown.
  void add_known(std::size_t method, const SpentTime& spent);

  // `now`: seconds of one clock, for all functions.
  void begin(std::size_t worker, std::size_t trial, double now);
  // The trial has mounted its lens and made this many captures; may be called at any intervals, or never.
  void advance(std::size_t worker, std::size_t captures, double now);
  void end(std::size_t worker, const SpentTime& spent);

  // Nothing until there is an estimate for the steps of a method.
  std::optional<Outlook> at(double now) const;

 private:
  // A mean that follows changes of the machine's speed.
  struct Mean {
    std::size_t count = 0;
    double value = 0, variance = 0;
    void add(double next);
  };
  struct Method {
    Mean later, first, first_without_once;  // seconds in steps
    Mean setup;                             // outside of steps, on a lens that was mounted before
    std::vector<double> known, known_once;  // of earlier runs: seconds in steps, and of these in a single long one
    double most_captures = 1;               // of a trial
    Mean captures;
    bool seen() const { return later.count + first.count + known.size() > 0; }
  };
  // The steps of a trial that runs, in seconds.
  struct Running {
    double capture = 0, once = 0;
  };
  struct Worker {
    std::set<std::size_t> methods;  // that have begun on it
    std::optional<std::size_t> group;
    std::optional<std::size_t> trial;
    double since = 0;
    bool first_of_method = false, mounts = false, starts = false;  // what its trial does first
    std::optional<double> mounted;                                 // when its lens was
    std::size_t captures = 0;                                      // so far
    double last = 0;                                               // when these were known
    double longest = 0;                                            // time between two reports of captures
    std::size_t in_longest = 0;                                    // captures in that time
    std::optional<Running> running() const;
    void begin(std::size_t trial, std::size_t group, std::size_t method);
  };
  enum class Case { expected, least, most };
  struct Costs;

  std::optional<Costs> costs(Case which) const;
  std::optional<Running> running(std::size_t method) const;
  double once_of_known(const Method& method) const;
  double seconds_of_steps(std::size_t number, const Method& method, Case which, double guess) const;
  Mean& outside_of_steps(const Worker& worker);
  double simulate(double now, const Costs& costs) const;

  std::vector<Trial> trials_;
  std::vector<std::vector<std::size_t>> groups_;
  std::map<std::size_t, std::size_t> group_of_;  // trial -> group
  std::set<std::size_t> begun_;
  std::vector<Worker> workers_;
  std::map<std::size_t, Method> methods_;
  std::map<std::size_t, Mean> mounting_;  // by scene: outside of steps, for the first trial of an instance
  Mean starting_;                         // the same for the first trial of a worker
};

}  // namespace relign::runner
