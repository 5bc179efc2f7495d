#include "imaging/wave_pupil.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "optics/elementary.h"

namespace relign::imaging {
namespace {

constexpr int kFitCells = 32;      // a side, of the rays that aims are fitted to
constexpr int kPupilCells = 80;    // a side, of autocorrelations
constexpr int kLargestDegree = 7;  // of the fit
constexpr double kClose = 1e-5;    // of the pupil's half width: an aim that is good enough

int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2; }

// Powers of x and y up to a degree in all, in a fixed order: visit(term, x^i y^j, its slopes along x and y).
template <class Visit>
void for_powers(int degree, double x, double y, const Visit& visit) {
  std::array<double, kLargestDegree + 1> of_x{}, of_y{};
  of_x[0] = of_y[0] = 1;
  for (std::size_t i = 1; i < of_x.size(); ++i) {
    of_x[i] = of_x[i - 1] * x;
    of_y[i] = of_y[i - 1] * y;
  }
  int term = 0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j, ++term) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      visit(term, of_x[a] * of_y[b], i > 0 ? i * of_x[a - 1] * of_y[b] : 0, j > 0 ? j * of_x[a] * of_y[b - 1] : 0);
    }
}

}  // namespace

WavePupil::WavePupil(const RayBundle& bundle, const Window& window, bool fresnel,
                     const std::array<double, 2>& direction)
    : bundle_(bundle), fresnel_(fresnel), along_(direction) {
  std::vector<std::array<double, 4>> rays;  // r, t, u, v
  const double per_cell_u = (window.high_u - window.low_u) / kFitCells;
  const double per_cell_v = (window.high_v - window.low_v) / kFitCells;
  Box found{1e300, -1e300, 1e300, -1e300};
  for (int i = 0; i < kFitCells; ++i)
    for (int j = 0; j < kFitCells; ++j) {
      const double u = window.low_u + (i + 0.5) * per_cell_u, v = window.low_v + (j + 0.5) * per_cell_v;
      const RayBundle::Light ray = bundle.at(u, v, false);
      if (!(ray.weight > 0)) continue;
      const double r = along_[0] * ray.p + along_[1] * ray.q, t = along_[0] * ray.q - along_[1] * ray.p;
      rays.push_back({r, t, u, v});
      found = {std::min(found.low_r, r), std::max(found.high_r, r), std::min(found.low_t, t),
               std::max(found.high_t, t)};
      x0_mm_ += ray.x_mm;
      y0_mm_ += ray.y_mm;
    }
  if (rays.size() < 6 || !(found.low_r < found.high_r && found.low_t < found.high_t)) return;
  x0_mm_ /= static_cast<double>(rays.size());
  y0_mm_ /= static_cast<double>(rays.size());
  middle_r_ = (found.low_r + found.high_r) / 2;
  middle_t_ = (found.low_t + found.high_t) / 2;
  half_ = std::max(found.high_r - found.low_r, found.high_t - found.low_t) / 2;
  fit_aims(rays);
  // The rim is up to one cell beyond the outermost ray.
  const double rim = 4 * half_ / kFitCells;
  box_ = {found.low_r - rim, found.high_r + rim, found.low_t - rim, found.high_t + rim};
}

void WavePupil::fit_aims(const std::vector<std::array<double, 4>>& rays) {
  degree_ = 1;
  while (degree_ < kLargestDegree && 3 * terms_of(degree_ + 1) <= static_cast<int>(rays.size())) ++degree_;
  const auto rows = static_cast<Eigen::Index>(rays.size());
  Eigen::MatrixXd powers(rows, terms_of(degree_)), aims(rows, 2);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto& [r, t, u, v] = rays[static_cast<std::size_t>(row)];
    for_powers(degree_, (r - middle_r_) / half_, (t - middle_t_) / half_,
               [&](int term, double power, double, double) { powers(row, term) = power; });
    aims(row, 0) = u;
    aims(row, 1) = v;
  }
  const Eigen::MatrixXd sums = powers.colPivHouseholderQr().solve(aims);
  of_u_.assign(sums.data(), sums.data() + sums.rows());
  of_v_.assign(sums.data() + sums.rows(), sums.data() + 2 * sums.rows());
}

WavePupil::Aim WavePupil::aim_for(double r, double t) const {
  Aim aim;
  double u_r = 0, u_t = 0, v_r = 0, v_t = 0;
  for_powers(degree_, (r - middle_r_) / half_, (t - middle_t_) / half_,
             [&](int term, double power, double along_r, double along_t) {
               const double of_u = of_u_[static_cast<std::size_t>(term)], of_v = of_v_[static_cast<std::size_t>(term)];
               aim.u_mm += of_u * power;
               aim.v_mm += of_v * power;
               u_r += of_u * along_r;
               u_t += of_u * along_t;
               v_r += of_v * along_r;
               v_t += of_v * along_t;
             });
  aim.area = std::fabs(u_r * v_t - u_t * v_r) / (half_ * half_);
  return aim;
}

WavePupil::Sample WavePupil::at(double r, double t) const {
  Sample sample;
  if (of_u_.empty()) return sample;
  const double p = along_[0] * r - along_[1] * t, q = along_[1] * r + along_[0] * t;
  const Aim aim = aim_for(r, t);
  RayBundle::Light ray = bundle_.at(aim.u_mm, aim.v_mm, fresnel_);
  if (!(ray.weight > 0)) return sample;
  const double off_r = r - (along_[0] * ray.p + along_[1] * ray.q), off_t = t - (along_[0] * ray.q - along_[1] * ray.p);
  if (std::fabs(off_r) + std::fabs(off_t) > kClose * half_) {
    const Aim nearer = aim_for(r + off_r, t + off_t);
    const RayBundle::Light again = bundle_.at(nearer.u_mm, nearer.v_mm, fresnel_);
    if (!(again.weight > 0)) return sample;
    ray = again;
  }
  sample.intensity = ray.weight * aim.area;
  // For the wanted direction instead of the ray's own: the slope of the phase with direction is the ray's hit, so that
  // the remaining difference in direction enters only quadratically.
  sample.path_mm = ray.path_mm - p * (ray.x_mm - x0_mm_) - q * (ray.y_mm - y0_mm_);
  return sample;
}

double WavePupil::light() const {
  if (of_u_.empty()) return 0;
  double sum = 0;
  for (int i = 0; i < kPupilCells; ++i)
    for (int j = 0; j < kPupilCells; ++j) {
      const int cell = i * kPupilCells + j;
      sum += at(box_.low_r + (box_.high_r - box_.low_r) * (i + scattered(cell, 0)) / kPupilCells,
                box_.low_t + (box_.high_t - box_.low_t) * (j + scattered(cell, 1)) / kPupilCells)
                 .intensity;
    }
  return sum * (box_.high_r - box_.low_r) * (box_.high_t - box_.low_t) / (kPupilCells * kPupilCells);
}

WavePupil::Overlap WavePupil::overlap(double lp_per_mm, Axis axis) const {
  const double wavelength = bundle_.wavelength_mm(), shear = lp_per_mm * wavelength;
  const double dr = axis == along ? shear / 2 : 0, dt = axis == across ? shear / 2 : 0;
  const double low_r = box_.low_r + dr, side_r = box_.high_r - dr - low_r;
  const double low_t = box_.low_t + dt, side_t = box_.high_t - dt - low_t;
  if (!(side_r > 0 && side_t > 0)) return {};
  double cosine = 0, sine = 0;
  for (int i = 0; i < kPupilCells; ++i)
    for (int j = 0; j < kPupilCells; ++j) {
      const int cell = i * kPupilCells + j;
      const double r = low_r + side_r * (i + scattered(cell, 0)) / kPupilCells;
      const double t = low_t + side_t * (j + scattered(cell, 1)) / kPupilCells;
      const Sample one = at(r + dr, t + dt);
      if (!(one.intensity > 0)) continue;
      const Sample other = at(r - dr, t - dt);
      if (!(other.intensity > 0)) continue;
      const double turns = (one.path_mm - other.path_mm) / wavelength;
      const optics::SineCosine phase = optics::sine_cosine_of_degrees(360 * (turns - std::floor(turns)));
      const double amplitude = std::sqrt(one.intensity * other.intensity);
      cosine += amplitude * phase.cosine;
      sine += amplitude * phase.sine;
    }
  return {cosine, sine, side_r, side_t};
}

double WavePupil::modulation(double lp_per_mm, Axis axis, double light) const {
  if (!(light > 0)) return 0;
  const auto [cosine, sine, side_r, side_t] = overlap(lp_per_mm, axis);
  const double sum = std::sqrt(cosine * cosine + sine * sine) * side_r * side_t / (kPupilCells * kPupilCells);
  return std::min(1.0, sum / light);
}

WavePupil::Transfer WavePupil::transfer(double lp_per_mm, Axis axis) const {
  const auto [cosine, sine, side_r, side_t] = overlap(lp_per_mm, axis);
  const double cell = side_r * side_t / (kPupilCells * kPupilCells);
  return {cosine * cell, sine * cell};
}

}  // namespace relign::imaging
