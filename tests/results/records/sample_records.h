// Small records for tests of the results folder.
#pragma once

#include <string>
#include <vector>

#include "records/record.h"
#include "records/step_numbers.h"

namespace relign::records {

inline TrialRecord sample_trial(const std::string& id, unsigned steps = 2) {
  TrialRecord record;
  record.trial = id;
  record.scene = "toy";
  record.noise_level = "calm";
  record.protocol = "paper";
  record.algorithm = "walker";
  record.algorithm_id = "toy-walker";
  record.instance = 7;
  record.instance_seed = 18446744073709551615U;
  record.end = "budget_spent";
  record.budget = steps;
  for (unsigned number = 0; number <= steps; ++number) {
    StepRecord step;
    step.step = number;
    step.commanded_pose = {0.5, 0.1 * number};
    step.true_pose = {0.501, 0.1 * number};
    step.merit = step.measured = 0.04 / (number + 1);
    step.machine_seconds = 0.1 * number;
    step.recommended_pose = step.commanded_pose;
    step.recommendation = "own";
    step.recommended_seconds = step.machine_seconds;
    step.recommended_true_pose = step.true_pose;
    step.commanded_mse = step.recommended_mse = 1e-4 / (number + 1);
    step.commanded_mse_error = step.recommended_mse_error = 1e-7;
    record.steps.push_back(step);
  }
  return record;
}

inline std::vector<StepNumbers> numbers_of(const TrialRecord& record) {
  StepNumbersReader reader;
  std::vector<StepNumbers> steps;
  for (const StepRecord& step : record.steps) steps.push_back(reader.read(step_line(record.trial, step), ""));
  set_scores(record, steps);
  return steps;
}

inline TrialTimes sample_times(const std::string& id, unsigned steps = 2) {
  TrialTimes times;
  times.trial = id;
  times.algorithm_seconds = std::vector<double>(steps + std::size_t{1}, 0.25);
  times.simulation_seconds = std::vector<double>(steps + std::size_t{1}, 0.5);
  times.truth_seconds = std::vector<double>(steps + std::size_t{1}, 1);
  times.plugins = {"a1", "b2", "c3"};
  return times;
}

}  // namespace relign::records
