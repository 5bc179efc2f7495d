// Compares two records of the same trial, for replays and for duplicates.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <type_traits>

#include "records/record.h"

namespace relign::records {

struct Difference {
  bool closing = false;  // in the closing line, not in a step line
  unsigned step = 0;
  std::string field;    // "measured", "commanded_pose[1]", "end"
  std::string was, is;  // as written in the files
  double size = 0;      // |is - was| of numbers, infinite otherwise
};

// "step 3, measured: was 0.041, is 0.042"
std::string to_string(const Difference& difference);

// The first difference in the order of the lines and their fields; nothing when all agree. Numbers agree when they are
// the same double or when |is - was| <= tolerance (1 + |was|); a tolerance of 0 requires equal bits. NaN equals NaN.
std::optional<Difference> first_difference(const TrialRecord& was, const TrialRecord& is, double tolerance = 0);

// The largest |is - was| / (1 + |was|) over all numbers of the steps that both have.
double largest_difference(const TrialRecord& was, const TrialRecord& is);

// Columns with kLater that a record of an older build lacks altogether, so that they cannot be compared: clears them in
// a newer record of the trial. First add(column, value) for the older record, then clear(column, value) for the other.
class LaterColumns {
 public:
  template <class Value>
  void add(const Column& column, const Value& value) {
    if (column.is(kLater) && is_known(value)) present_.insert(std::string(column.key));
  }
  template <class Value>
  void clear(const Column& column, Value& value) {
    if (!column.is(kLater) || !is_known(value) || present_.count(std::string(column.key)) > 0) return;
    if constexpr (std::is_same_v<Value, double>)
      value = kUnknown;
    else
      value = {};
    cleared_.insert(std::string(column.key));
  }
  const std::set<std::string>& cleared() const { return cleared_; }

 private:
  std::set<std::string> present_, cleared_;
};
// The same for all columns: the keys that were cleared in `newer`.
std::set<std::string> clear_later(const TrialRecord& older, TrialRecord& newer);
// Numbers of trials by column that was not compared: "'humidity' of 30 trials". Empty without any.
using NotCompared = std::map<std::string, std::size_t>;
std::string to_string(const NotCompared& columns);

// For messages: "compass on relign_od rho0.25 #3".
std::string label_of(const TrialRecord& trial);

// Tolerance between processors for a plugin that is reproducible only on one processor ("this_cpu").
inline constexpr double kOtherCpuTolerance = 1e-6;

}  // namespace relign::records
