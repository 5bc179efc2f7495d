// Fits the hyperparameters of the sources.
#pragma once

#include "source_data.hpp"
#include "surrogates/likelihood.hpp"

namespace transfer_gp {

// Bounds for the kernels of sources and target. The amplitude may be small, because instances may hardly differ.
surrogates::ThetaBounds theta_bounds(Eigen::Index dimensions);
// The start of the first fit.
Vector first_theta(Eigen::Index dimensions);

// Fits one source after the other, each to the residuals of the previous ones (the stacks of Tighineanu et al.).
// Returns the model of all sources.
SourceModel fit_in_turn(SourceData& data, Shape shape, Stacking stacking);

// Maximises the joint likelihood of all samples from the current hyperparameters, for at most `iterations`.
void fit_together(SourceData& data, Shape shape, int iterations);

// The joint likelihood (exact stacking). thetas: those of all sources, concatenated. gradient may be null.
double joint_log_likelihood(const SourceData& data, Shape shape, const Vector& thetas, Vector* gradient);

}  // namespace transfer_gp
