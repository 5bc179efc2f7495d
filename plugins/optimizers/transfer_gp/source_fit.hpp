// Hyper-parameters of the sources.
#pragma once

#include "source_data.hpp"
#include "surrogates/likelihood.hpp"

namespace transfer_gp {

// Of the target's kernel and of those of the sources: amplitude may be small, where instances hardly differ.
surrogates::ThetaBounds theta_bounds(Eigen::Index dimensions);
// Before anything is known.
Vector first_theta(Eigen::Index dimensions);

// One source after the other, each on what the ones before it left (the stacks of Tighineanu et al.). The model has
// them all at the end.
SourceModel fit_in_turn(SourceData& data, Shape shape, Stacking stacking);

// All of them together by the likelihood of all samples, from where they are, for so many iterations.
void fit_together(SourceData& data, Shape shape, int iterations);

// That likelihood (exact stacking); `thetas` one after the other. The gradient may be null.
double joint_log_likelihood(const SourceData& data, Shape shape, const Vector& thetas, Vector* gradient);

}  // namespace transfer_gp
