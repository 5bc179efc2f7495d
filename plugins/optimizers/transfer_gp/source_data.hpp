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

// Brings the merits of all sources, and of the target, to one scale: mean 0, deviation 1. Above the middle of them,
// where nobody will look for the optimum, they may be compressed before, so that the well below is not a dent in a
// mountain.
struct Scale {
  surrogates::Standard standard;
  double middle = 0, unit = 0;  // unit 0: nothing is compressed

  double operator()(double merit) const;
  Vector operator()(const Vector& merits) const { return merits.unaryExpr(*this); }
};

struct SourceData {
  std::size_t dimensions = 0;
  bool compress = false;
  std::vector<Source> sources;
  bool finished = false;  // fitted, with candidates
  Candidates candidates;  // no covariance

  Scale scale() const;

  std::string to_bytes() const;
  // Throws std::runtime_error with a sentence.
  static SourceData from_bytes(const std::string& bytes);
};

// The model of finished data.
SourceModel model_of(const SourceData& data, Shape shape, Stacking stacking);

}  // namespace transfer_gp
