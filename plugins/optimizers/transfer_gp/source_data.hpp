// The pretraining data: samples of the sources, their fitted hyperparameters, and candidates whitened by their
// covariance. Reading validates the bytes, which may be damaged.
#pragma once

#include <string>
#include <vector>

#include "surrogates/standard.hpp"
#include "target_model.hpp"

namespace transfer_gp {

struct Source {
  Matrix points;  // d x n, in the unit cube
  Vector merits;  // finite, not scaled
  Vector theta;   // empty until fitted
};

// Scales merits of sources and target to mean 0 and deviation 1 over the sources. Optionally compresses merits above
// the median by a logarithm first, so that the range below it, which contains the optimum, is resolved.
struct Scale {
  surrogates::Standard standard;
  double middle = 0, unit = 0;  // unit 0: no compression

  double operator()(double merit) const;
  Vector operator()(const Vector& merits) const { return merits.unaryExpr(*this); }
};

struct SourceData {
  std::size_t dimensions = 0;
  bool compress = false;
  std::vector<Source> sources;
  bool finished = false;  // fitted and with candidates
  Candidates candidates;  // without covariance

  Scale scale() const;

  std::string to_bytes() const;
  // Throws std::runtime_error if the bytes are damaged or inconsistent.
  static SourceData from_bytes(const std::string& bytes);
};

// data: finished.
SourceModel model_of(const SourceData& data, Shape shape, Stacking stacking);

}  // namespace transfer_gp
