// What is kept of the sources: their samples, then the hyper-parameters fitted to them and the candidates whitened by
// them. Bytes come from a file that anybody may have touched: reading checks them.
#pragma once

#include <string>
#include <vector>

#include "surrogates/standard.hpp"
#include "target_model.hpp"

namespace transfer_gp {

struct Source {
  Matrix points;  // d x n, in the unit cube
  Vector merits;  // usable numbers, in their own units
  Vector theta;   // empty until fitted
};

struct SourceData {
  std::size_t dimensions = 0;
  std::vector<Source> sources;
  bool finished = false;  // fitted, with candidates
  Candidates candidates;  // no covariance

  // Brings the merits of all sources, and of the target, to one scale.
  surrogates::Standard standard() const;

  std::string to_bytes() const;
  // Throws std::runtime_error with a sentence.
  static SourceData from_bytes(const std::string& bytes);
};

// The model of finished data.
SourceModel model_of(const SourceData& data, Shape shape, Stacking stacking);

}  // namespace transfer_gp
