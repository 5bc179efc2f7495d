#include "scrambled_sobol.hpp"

#include <bitset>
#include <boost/random/sobol.hpp>
#include <cstdint>
#include <vector>

namespace bo_turbo {
namespace {

constexpr int kDigits = 32;

struct Scramble {
  std::uint32_t rows[kDigits];  // digits of the input whose sum modulo 2 is a digit of the output, lowest digit first
  std::uint32_t shift;

  explicit Scramble(relign::Random& random) {
    // Each digit depends on itself and on more significant ones, so the scramble keeps the sequence's equidistribution.
    for (int digit = 0; digit < kDigits; ++digit) rows[digit] = (random.bits() | std::uint32_t{1}) << digit;
    shift = random.bits();
  }
  std::uint32_t operator()(std::uint32_t value) const {
    std::uint32_t made = 0;
    for (int digit = 0; digit < kDigits; ++digit)
      made |= static_cast<std::uint32_t>(std::bitset<kDigits>(rows[digit] & value).count() & 1) << digit;
    return made ^ shift;
  }
};

}  // namespace

Matrix scrambled_sobol(relign::Random& random, std::size_t dimensions, std::size_t count) {
  std::vector<Scramble> scrambles;
  for (std::size_t axis = 0; axis < dimensions; ++axis) scrambles.emplace_back(random);
  boost::random::sobol_engine<std::uint32_t, kDigits> sequence(dimensions);
  Matrix points(static_cast<Eigen::Index>(dimensions), static_cast<Eigen::Index>(count));
  for (auto point : points.colwise())
    for (std::size_t axis = 0; axis < dimensions; ++axis)
      point[static_cast<Eigen::Index>(axis)] = 0x1p-32 * scrambles[axis](sequence());
  return points;
}

Matrix masked_candidates(relign::Random& random, const Vector& centre, const Sides& sides, std::size_t count,
                         double probability) {
  const auto axes = static_cast<std::size_t>(centre.size());
  const Matrix sobol = scrambled_sobol(random, axes, count);
  Matrix made = centre.replicate(1, sobol.cols());
  for (Eigen::Index i = 0; i < made.cols(); ++i) {
    const auto replace = [&](Eigen::Index axis) {
      made(axis, i) = sides.lower[axis] + (sides.upper[axis] - sides.lower[axis]) * sobol(axis, i);
    };
    bool any = false;
    for (Eigen::Index axis = 0; axis < centre.size(); ++axis)
      if (random.uniform() < probability) {
        replace(axis);
        any = true;
      }
    if (!any) replace(static_cast<Eigen::Index>(random.below(axes)));
  }
  return made;
}

}  // namespace bo_turbo
