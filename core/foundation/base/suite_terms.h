// What a suite states and its results keep: machine times, a module's cycle, prices, and the analysis plan.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/described.h"

namespace relign {

inline constexpr double kLargestTerm = 1e9;

// "machine_time": the simulated clock. Absent keys take the caller's defaults.
struct MachineTimeKeys {
  std::optional<double> speed_mm_per_s, speed_deg_per_s, settle_ms, exposure_ms, readout_ms;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    const auto speed = [](std::string_view key, std::string_view meaning) {
      return Member{.key = key, .meaning = meaning, .flags = kLeftOut | kAboveLeast, .least = 0, .most = kLargestTerm};
    };
    const auto time = [](std::string_view key, std::string_view meaning) {
      return Member{.key = key, .meaning = meaning, .flags = kLeftOut, .least = 0, .most = kLargestTerm};
    };
    visit(speed("speed_mm_per_s", "of the stage, millimetres per second"), s.speed_mm_per_s...);
    visit(speed("speed_deg_per_s", "of the stage, degrees per second"), s.speed_deg_per_s...);
    visit(time("settle_ms", "until the stage is quiet, milliseconds"), s.settle_ms...);
    visit(time("exposure_ms", "of one capture, milliseconds"), s.exposure_ms...);
    visit(time("readout_ms", "of one capture, milliseconds"), s.readout_ms...);
  }
  bool operator==(const MachineTimeKeys&) const = default;
};

// "cycle": what is added to the machine time of alignment, in seconds.
struct CycleTimes {
  double load_s = 0, dispense_s = 0, cure_s = 0, inspect_s = 0;
  bool computing = false;

  double seconds() const { return load_s + dispense_s + cure_s + inspect_s; }

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    const auto time = [](std::string_view key, std::string_view meaning) {
      return Member{.key = key, .meaning = meaning, .flags = kMayLack, .least = 0, .most = kLargestTerm};
    };
    visit(time("load_s", "seconds to load lens and sensor"), s.load_s...);
    visit(time("dispense_s", "seconds to dispense the glue"), s.dispense_s...);
    visit(time("cure_s", "seconds until the stage may release the lens"), s.cure_s...);
    visit(time("inspect_s", "seconds to inspect and unload"), s.inspect_s...);
    visit(Member{"computing", "whether the method's own computing time counts; it differs from run to run", kMayLack},
          s.computing...);
  }
  bool operator==(const CycleTimes&) const = default;
};

// "cost": prices of a line, all in the suite's currency.
struct Prices {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double station_per_hour = kNone;  // NaN: the suite states no prices
  double module = 0;                // parts lost with a module that is scrapped
  double rework = kNone;            // of aligning a module that misses once more; NaN: it is scrapped
  double training_per_hour = kNone;
  std::string baseline;  // method in use today; "" if not stated
  std::string currency;  // "" if not stated

  bool stated() const { return station_per_hour == station_per_hour; }

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    const auto price = [](std::string_view key, std::string_view meaning, unsigned flags = 0) {
      return Member{.key = key, .meaning = meaning, .flags = flags, .least = 0, .most = kLargestTerm};
    };
    visit(price("station_per_hour", "price of an hour of the alignment station"), s.station_per_hour...);
    visit(price("module", "parts lost with a module that is scrapped", kMayLack), s.module...);
    visit(price("rework", "of preparing a module that missed for one more alignment; without it the module is scrapped",
                kLeftOut),
          s.rework...);
    visit(price("training_per_hour", "price of an hour of training, for its break-even", kLeftOut),
          s.training_per_hour...);
    visit(Member{"baseline", "name of the method that the line uses today", kLeftOut}, s.baseline...);
    visit(Member{"currency", "shown with prices", kLeftOut}, s.currency...);
  }
};

// "analysis": what a study compares and by which rule, with defaults filled in.
struct AnalysisPlan {
  std::string primary = "rmse", rule = "own";
  std::vector<std::array<std::string, 2>> contrasts;
  double smallest_relevant_ratio = 1;
  double yield = std::numeric_limits<double>::quiet_NaN();  // NaN: none

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "primary", .one_of = "rmse yield"}, s.primary...);
    visit(Member{.key = "rule", .one_of = "own best current"}, s.rule...);
    visit(Member{"contrasts", "pairs of methods", kMayLack}, s.contrasts...);
    visit(Member{.key = "smallest_relevant_ratio", .least = 1}, s.smallest_relevant_ratio...);
    visit(Member{.key = "yield", .flags = kMayLack | kMayBeNull, .least = 0, .most = 1}, s.yield...);
  }
};

}  // namespace relign
