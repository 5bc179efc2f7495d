#include "statistics/excess.h"

#include <algorithm>
#include <cmath>

namespace relign::statistics {

std::vector<double> excess_errors(const std::vector<records::StepNumbers>& steps, double own_optimum_mse, Rule rule,
                                  const SceneScore& score) {
  std::vector<double> values = recommended_mse(steps, track_of(rule));
  for (double& value : values) value = score.shown(value - own_optimum_mse);
  return values;
}

std::vector<unsigned> excess_images(unsigned last) {
  std::vector<unsigned> images;
  for (const unsigned count : {6U, 12U, 50U})
    if (count < last) images.push_back(count);
  images.push_back(last);
  return images;
}

ExcessColumns::ExcessColumns(const Series& series)
    : images_(excess_images(series.largest_budget)), values_(images_.size()) {
  for (ByRule<std::vector<double>>& of_images : values_)
    for (std::vector<double>& column : of_images.values) column.assign(series.trials.size(), kMissing);
}

void ExcessColumns::add(const ReadTrial& trial) {
  for (const Rule rule : kRules) {
    const std::vector<double> values = excess_errors(trial.steps, trial.row.own_optimum_mse, rule, trial.series.score);
    for (std::size_t place = 0; place < images_.size(); ++place)
      values_[place][rule][trial.place] = values[std::min<std::size_t>(images_[place], values.size() - 1)];
  }
}

bool ExcessColumns::any() const {
  for (const auto& of_images : values_)
    for (const std::vector<double>& column : of_images.values)
      if (std::any_of(column.begin(), column.end(), [](double value) { return !std::isnan(value); })) return true;
  return false;
}

}  // namespace relign::statistics
