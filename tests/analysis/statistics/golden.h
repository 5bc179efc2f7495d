// Reference values of other programs, written by tests/analysis/statistics/make_golden.py.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/files.h"

namespace relign::test {

inline nlohmann::json golden(const std::string& name) {
  return nlohmann::json::parse(read_file(RELIGN_TEST_DATA "/statistics/" + name + ".json"));
}

inline double number(const nlohmann::json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

inline std::vector<double> numbers(const nlohmann::json& list) {
  std::vector<double> result;
  for (const auto& value : list) result.push_back(number(value));
  return result;
}

// Relative tolerance above 1, absolute below.
inline void expect_close(double value, double expected, double error = 1e-12) {
  EXPECT_NEAR(value, expected, error * std::max(1.0, std::abs(expected)));
}

}  // namespace relign::test
