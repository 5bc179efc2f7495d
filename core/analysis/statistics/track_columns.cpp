#include "statistics/track_columns.h"

#include <algorithm>

namespace relign::statistics {

void for_each_trial(const TrialTable& table, const Series& series, const std::function<void(const ReadTrial&)>& visit) {
  records::StoredSteps stored(table.folder);
  for (std::size_t place = 0; place < series.trials.size(); ++place) {
    const TrialRow& row = table.rows[series.trials[place]];
    visit({place, series, row, stored.read(row.where), stored});
  }
}

TrackColumns::TrackColumns(std::size_t trials, std::vector<Track> tracks, StepRange steps)
    : tracks_(std::move(tracks)), steps_(steps), trials_(trials) {
  values_.resize(tracks_.size() * (steps.last - steps.first + std::size_t{1}) * trials_);
}

void TrackColumns::add(const ReadTrial& trial) {
  const std::size_t count = steps_.last - steps_.first + std::size_t{1};
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    const std::vector<double> values =
        track_values(trial.steps, trial.row.own_optimum_mse, tracks_[track], trial.series.score);
    for (std::size_t step = 0; step < count; ++step)
      values_[(track * count + step) * trials_ + trial.place] =
          values[std::min(steps_.first + step, values.size() - 1)];
  }
}

std::vector<double> TrackColumns::at(Track track, unsigned step) const {
  const auto place = static_cast<std::size_t>(std::find(tracks_.begin(), tracks_.end(), track) - tracks_.begin());
  const std::size_t count = steps_.last - steps_.first + std::size_t{1};
  const auto begin = values_.begin() + static_cast<std::ptrdiff_t>((place * count + step - steps_.first) * trials_);
  return {begin, begin + static_cast<std::ptrdiff_t>(trials_)};
}

}  // namespace relign::statistics
