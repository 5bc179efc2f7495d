#include "stats/track_columns.h"

#include <algorithm>

namespace relign::stats {

TrackColumns::TrackColumns(const TrialTable& table, const Series& series, std::vector<Track> tracks, StepRange steps)
    : tracks_(std::move(tracks)), steps_(steps), trials_(series.trials.size()) {
  const std::size_t count = steps.last - steps.first + std::size_t{1};
  values_.resize(tracks_.size() * count * trials_);
  records::StoredSteps stored(table.folder);
  for (std::size_t trial = 0; trial < trials_; ++trial) {
    const TrialRow& row = table.rows[series.trials[trial]];
    const std::vector<records::StepNumbers>& read = stored.read(row.where);
    for (std::size_t track = 0; track < tracks_.size(); ++track) {
      const std::vector<double> values = track_values(read, row.own_optimum_mse, tracks_[track]);
      for (std::size_t step = 0; step < count; ++step)
        values_[(track * count + step) * trials_ + trial] = values[std::min(steps.first + step, values.size() - 1)];
    }
  }
}

std::vector<double> TrackColumns::at(Track track, unsigned step) const {
  const auto place = static_cast<std::size_t>(std::find(tracks_.begin(), tracks_.end(), track) - tracks_.begin());
  const std::size_t count = steps_.last - steps_.first + std::size_t{1};
  const auto begin = values_.begin() + static_cast<std::ptrdiff_t>((place * count + step - steps_.first) * trials_);
  return {begin, begin + static_cast<std::ptrdiff_t>(trials_)};
}

}  // namespace relign::stats
