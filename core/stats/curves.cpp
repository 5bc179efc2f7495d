#include "stats/curves.h"

#include <algorithm>

#include "stats/track_columns.h"

namespace relign::stats {
namespace {

// The tracks and steps that are held at once: all, or one track's, or a few steps of one.
struct Piece {
  std::vector<Track> tracks;
  StepRange steps;
};

std::vector<Piece> pieces(std::size_t trials, unsigned last_step, std::size_t most_bytes) {
  const std::size_t steps = last_step + std::size_t{1};
  if (TrackColumns::bytes(trials, kTracks.size(), steps) <= most_bytes)
    return {{{kTracks.begin(), kTracks.end()}, {0, last_step}}};
  const std::size_t at_once =
      std::clamp<std::size_t>(most_bytes / TrackColumns::bytes(std::max<std::size_t>(trials, 1), 1, 1), 1, steps);
  std::vector<Piece> list;
  for (const Track track : kTracks)
    for (std::size_t first = 0; first < steps; first += at_once)
      list.push_back(
          {{track}, {static_cast<unsigned>(first), static_cast<unsigned>(std::min(first + at_once, steps) - 1)}});
  return list;
}

}  // namespace

std::vector<Curve> make_curves(const TrialTable& table, std::size_t most_bytes) {
  std::vector<Curve> curves;
  for (const Series& series : table.series) {
    Curve curve{
        series.scene, series.noise_level, series.protocol, series.algorithm, series.trials.size(), series.failed, {}};
    if (!series.trials.empty()) {
      curve.points.resize(series.largest_budget + std::size_t{1});
      for (std::size_t step = 0; step < curve.points.size(); ++step)
        curve.points[step].step = static_cast<unsigned>(step);
      for (const Piece& piece : pieces(series.trials.size(), series.largest_budget, most_bytes)) {
        const TrackColumns columns(table, series, piece.tracks, piece.steps);
        for (const Track track : piece.tracks)
          for (unsigned step = piece.steps.first; step <= piece.steps.last; ++step)
            curve.points[step].tracks[static_cast<std::size_t>(track)] = quantiles(columns.at(track, step));
      }
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

}  // namespace relign::stats
