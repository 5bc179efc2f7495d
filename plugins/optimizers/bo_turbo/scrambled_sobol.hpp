// Scrambled Sobol points, and candidates in a trust region.
#pragma once

#include <relign/random.hpp>

#include "trust_region.hpp"

namespace bo_turbo {

// dimensions x count in [0, 1), one point per column: a Sobol sequence (Joe and Kuo's direction numbers) under a random
// linear scramble and a random digital shift of its 32 binary digits (Matousek, 1998).
Matrix scrambled_sobol(relign::Random& random, std::size_t dimensions, std::size_t count);

// The centre with each coordinate replaced, with the given probability, by that of a Sobol point in the sides: at least
// one coordinate per candidate.
Matrix masked_candidates(relign::Random& random, const Vector& centre, const Sides& sides, std::size_t count,
                         double probability);

}  // namespace bo_turbo
