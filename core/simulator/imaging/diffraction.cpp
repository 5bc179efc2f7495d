#include "imaging/diffraction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "imaging/ray_bundle.h"
#include "imaging/wave_pupil.h"
#include "optics/elementary.h"
#include "optics/first_order.h"

namespace relign::imaging {
namespace {

constexpr int kRaster = 64;        // cells a side, of a pupil's shape
constexpr int kBlock = 16;         // pixels a side that share one blended kernel
constexpr double kCloseTo = 0.01;  // allowed error of the transfer, between the frequencies at which kernels are exact
constexpr int kRounds = 5;         // of the search for the emitter's place
constexpr int kCoarse = 9;         // rays a side, for the middle of a bundle

double cosine_of_turns(double turns) {
  return optics::sine_cosine_of_degrees(360 * (turns - std::floor(turns))).cosine;
}

// Index into a row of `count` pixels that is continued by reflection.
int reflected_index(int place, int count) {
  const int period = 2 * count;
  const int in_period = ((place % period) + period) % period;
  return in_period < count ? in_period : period - 1 - in_period;
}

// Finds the point of the emitter's plane whose light hits the sensor's plane at `wanted`, by rays of the perfect lens.
class PlaceFinder {
 public:
  // lens: of the scene, at one of its wavelengths.
  PlaceFinder(const SceneFile& scene, const optics::Prescription& lens)
      : scene_(scene), lens_(lens), pose_(scene.axes(), 0.5), aim_(pupil_aim(scene)) {
    const optics::FirstOrder data = optics::first_order(scene.lens);
    const double first_z = scene.lens.elements.front().faces.front().z_mm;
    const double object_z = scene.emitter.z_mm + scene.pivot_behind_first_vertex_mm;
    image_per_object_ = -data.focal_length / (first_z + data.front_focal_length - object_z);
  }

  // Empty when no light arrives there.
  std::optional<std::array<double, 2>> find(const std::array<double, 2>& wanted) const {
    std::array<double, 2> from{wanted[0] / image_per_object_, wanted[1] / image_per_object_};
    for (int round = 0; round < kRounds; ++round) {
      const std::optional<std::array<double, 2>> middle = meets(bundle(from));
      if (!middle) return std::nullopt;
      for (std::size_t i = 0; i < 2; ++i) from[i] += (wanted[i] - (*middle)[i]) / image_per_object_;
    }
    return from;
  }
  RayBundle bundle(const std::array<double, 2>& from) const {
    return RayBundle(scene_, lens_, pose_, from, aim_.z_mm, lens_.lens().wavelength_nm);
  }
  Window window(const RayBundle& bundle) const { return passing_window(bundle, aim_); }

 private:
  std::optional<std::array<double, 2>> meets(const RayBundle& bundle) const {
    const Window window = passing_window(bundle, aim_);
    if (!(window.low_u < window.high_u)) return std::nullopt;
    double x = 0, y = 0, count = 0;
    for (int i = 0; i < kCoarse; ++i)
      for (int j = 0; j < kCoarse; ++j) {
        const RayBundle::Light ray =
            bundle.at(window.low_u + (window.high_u - window.low_u) * (i + 0.5) / kCoarse,
                      window.low_v + (window.high_v - window.low_v) * (j + 0.5) / kCoarse, false);
        if (!(ray.weight > 0)) continue;
        x += ray.x_mm;
        y += ray.y_mm;
        ++count;
      }
    if (!(count > 0)) return std::nullopt;
    return std::array<double, 2>{x / count, y / count};
  }

  const SceneFile& scene_;
  optics::Assembly lens_;
  std::vector<double> pose_;
  PupilAim aim_;
  double image_per_object_ = 0;
};

}  // namespace

// The pupil's shape on a raster of direction cosines, and its autocorrelation.
struct Diffraction::Shape {
  Shape() = default;  // without light
  // largest: frequency, cycles a pixel.
  Shape(const WavePupil& pupil, double cycles_to_cosines, double largest) {
    const WavePupil::Box& box = pupil.box();
    const double cell = std::max(box.high_r - box.low_r, box.high_t - box.low_t) / kRaster;
    if (!(cell > 0)) return;
    std::vector<double> amplitude(kRaster * kRaster, 0.0);
    for (int row = 0; row < kRaster; ++row)
      for (int column = 0; column < kRaster; ++column)
        amplitude[static_cast<std::size_t>(row * kRaster + column)] =
            std::sqrt(pupil.at(box.low_r + (column + 0.5) * cell, box.low_t + (row + 0.5) * cell).intensity);
    cells_per_cycle = cycles_to_cosines / cell;
    lags = std::min(kRaster, static_cast<int>(std::ceil(largest * cells_per_cycle)) + 1);
    const int side = 2 * lags + 1;
    table.assign(static_cast<std::size_t>(side) * static_cast<std::size_t>(lags + 1), 0.0);
    for (int down = 0; down <= lags; ++down)
      for (int right = -lags; right <= lags; ++right) {
        double sum = 0;
        for (int row = 0; row + down < kRaster; ++row) {
          const double* one = amplitude.data() + row * kRaster;
          const double* other = amplitude.data() + (row + down) * kRaster;
          for (int column = std::max(0, -right); column < std::min(kRaster, kRaster - right); ++column)
            sum += one[column] * other[column + right];
        }
        table[static_cast<std::size_t>(down * side + right + lags)] = sum;
      }
    const double all = table[static_cast<std::size_t>(lags)];
    light = all * cell * cell;
    if (all > 0)
      for (double& value : table) value /= all;
    else
      table.clear();
  }

  double lag(int right, int down) const {
    if (down < 0) return lag(-right, -down);
    if (down > lags || right > lags || right < -lags) return 0;
    return table[static_cast<std::size_t>(down * (2 * lags + 1) + right + lags)];
  }
  // Diffraction-limited transfer, cycles a pixel along x and y of the world; 1 everywhere without light.
  double transfer(double cycles_x, double cycles_y) const {
    if (table.empty()) return 1;
    const double right = cycles_x * cells_per_cycle, down = cycles_y * cells_per_cycle;
    const double i = std::floor(right), j = std::floor(down);
    const int a = static_cast<int>(i), b = static_cast<int>(j);
    const double fi = right - i, fj = down - j;
    return (1 - fj) * ((1 - fi) * lag(a, b) + fi * lag(a + 1, b)) +
           fj * ((1 - fi) * lag(a, b + 1) + fi * lag(a + 1, b + 1));
  }
  // Has this transfer at whole multiples of 1 / (2 radius + 1). Rows of images run against world y.
  Kernel kernel(int radius) const {
    const int side = 2 * radius + 1;
    std::vector<double> cosines(static_cast<std::size_t>(side));
    for (int k = 0; k < side; ++k)
      cosines[static_cast<std::size_t>(k)] = cosine_of_turns(static_cast<double>(k) / side);
    std::vector<double> wanted(static_cast<std::size_t>(side * side));
    for (int m = -radius; m <= radius; ++m)
      for (int n = -radius; n <= radius; ++n)
        wanted[static_cast<std::size_t>((m + radius) * side + n + radius)] =
            transfer(static_cast<double>(n) / side, -static_cast<double>(m) / side);
    Kernel found(static_cast<std::size_t>(side * side));
    for (int y = -radius; y <= radius; ++y)
      for (int x = -radius; x <= radius; ++x) {
        double sum = 0;
        for (int m = -radius; m <= radius; ++m)
          for (int n = -radius; n <= radius; ++n) {
            const int turn = (((m * y + n * x) % side) + side) % side;
            sum += wanted[static_cast<std::size_t>((m + radius) * side + n + radius)] *
                   cosines[static_cast<std::size_t>(turn)];
          }
        found[static_cast<std::size_t>((y + radius) * side + x + radius)] = sum / (side * side);
      }
    return found;
  }

  double cells_per_cycle = 0;
  double light = 0;
  int lags = 0;
  std::vector<double> table;  // lags down from 0, right from -lags
};

// The pupil shapes of one point at several wavelengths, each with its share of the light.
struct Diffraction::Shapes {
  std::vector<Shape> shapes;
  std::vector<double> shares;

  void add(Shape shape, double weight) {
    shares.push_back(weight * shape.light);
    shapes.push_back(std::move(shape));
  }
  // A single shape, or shapes without light, share equally.
  void settle() {
    double sum = 0;
    for (const double share : shares) sum += share;
    for (double& share : shares) share = shares.size() > 1 && sum > 0 ? share / sum : 1.0 / shares.size();
  }
  double transfer(double cycles_x, double cycles_y) const {
    double sum = 0;
    for (std::size_t i = 0; i < shapes.size(); ++i) sum += shares[i] * shapes[i].transfer(cycles_x, cycles_y);
    return sum;
  }
  Kernel kernel(int radius) const {
    Kernel sum;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const Kernel one = shapes[i].kernel(radius);
      sum.resize(one.size());
      for (std::size_t k = 0; k < one.size(); ++k) sum[k] += shares[i] * one[k];
    }
    return sum;
  }
};

namespace {

double transfer_of(const std::vector<double>& kernel, int radius, double cycles_x, double cycles_y) {
  const int side = 2 * radius + 1;
  double sum = 0;
  for (int y = -radius; y <= radius; ++y)
    for (int x = -radius; x <= radius; ++x)
      sum += kernel[static_cast<std::size_t>((y + radius) * side + x + radius)] *
             cosine_of_turns(cycles_x * x - cycles_y * y);
  return sum;
}

}  // namespace

Diffraction::Diffraction(const SceneFile& scene) : width_(scene.sensor.width), height_(scene.sensor.height) {
  std::vector<const optics::Prescription*> lenses;
  std::vector<double> weights;
  for (const SceneWavelength& one : scene.wavelengths) {
    lenses.push_back(&one.lens);
    weights.push_back(one.weight);
  }
  if (lenses.empty()) {
    lenses.push_back(&scene.lens);
    weights.push_back(1);
  }
  std::vector<Shapes> zones(static_cast<std::size_t>(kZones * kZones));
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    const PlaceFinder finder(scene, *lenses[i]);
    for (int zone = 0; zone < kZones * kZones; ++zone) {
      const optics::Vec3 place =
          scene.sensor.place(width_ * (zone % kZones) / (kZones - 1.0), height_ * (zone / kZones) / (kZones - 1.0));
      Shapes& shapes = zones[static_cast<std::size_t>(zone)];
      // If a zone is dark, the nearest lit point towards the axis.
      std::optional<std::array<double, 2>> from;
      for (double share = 1; share >= 0 && !from; share -= 0.25) from = finder.find({share * place.x, share * place.y});
      if (!from) {
        shapes.add({}, weights[i]);
        continue;
      }
      const RayBundle bundle = finder.bundle(*from);
      const WavePupil pupil(bundle, finder.window(bundle), false, {1, 0});
      shapes.add({pupil, bundle.wavelength_mm() / scene.sensor.pitch_mm, 0.5}, weights[i]);
    }
  }
  for (Shapes& shapes : zones) shapes.settle();
  const auto largest_miss = [&](const Shapes& shape, const Kernel& kernel) {
    const int side = 2 * radius_ + 1;
    double miss = 0;
    for (int k = 0; k < radius_; ++k) {
      const double cycles = (k + 0.5) / side;
      miss = std::max({miss, std::fabs(transfer_of(kernel, radius_, cycles, 0) - shape.transfer(cycles, 0)),
                       std::fabs(transfer_of(kernel, radius_, 0, cycles) - shape.transfer(0, cycles))});
    }
    return miss;
  };
  for (radius_ = 1; radius_ <= kMaxRadius; ++radius_) {
    double miss = 0;
    for (const Shapes& shapes : zones) miss = std::max(miss, largest_miss(shapes, shapes.kernel(radius_)));
    if (miss <= kCloseTo) break;
  }
  radius_ = std::min(radius_, kMaxRadius);
  for (const Shapes& shapes : zones) kernels_.push_back(shapes.kernel(radius_));
}

namespace {

// The zone before a place, and how far on to the next.
struct Between {
  int zone = 0;
  double share = 0;
};

Between between(double place, int count, int zones) {
  const double at = std::clamp(place / count, 0.0, 1.0) * (zones - 1);
  const int zone = std::min(zones - 2, static_cast<int>(at));
  return {zone, at - zone};
}

}  // namespace

Diffraction::Kernel Diffraction::blended(double column, double row) const {
  const Between across = between(column, width_, kZones), down = between(row, height_, kZones);
  Kernel sum(kernels_.front().size(), 0.0);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const double weight = (i ? down.share : 1 - down.share) * (j ? across.share : 1 - across.share);
      const Kernel& kernel = kernels_[static_cast<std::size_t>((down.zone + i) * kZones + across.zone + j)];
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += weight * kernel[k];
    }
  return sum;
}

double Diffraction::transfer(double column, double row, double cycles_x, double cycles_y) const {
  return transfer_of(blended(column, row), radius_, cycles_x, cycles_y);
}

double Diffraction::overlap() const {
  const Kernel kernel = blended(width_ / 2.0, height_ / 2.0);
  const int side = 2 * radius_ + 1;
  double sum = 0;
  for (int y = 1 - side; y < side; ++y)
    for (int x = 1 - side; x < side; ++x) {
      double both = 0;
      for (int row = std::max(0, -y); row < std::min(side, side - y); ++row)
        for (int column = std::max(0, -x); column < std::min(side, side - x); ++column)
          both += kernel[static_cast<std::size_t>(row * side + column)] *
                  kernel[static_cast<std::size_t>((row + y) * side + column + x)];
      sum += both * both;
    }
  return sum;
}

void Diffraction::blur(const float* image, float* blurred, Parallel& parallel, Workspace& work) const {
  // The image with a reflected border; then one kernel per thread.
  const int side = 2 * radius_ + 1, padded_width = width_ + 2 * radius_ + kBlock;
  const auto padded = static_cast<std::size_t>(padded_width) * static_cast<std::size_t>(height_ + 2 * radius_);
  const auto taps = static_cast<std::size_t>(side * side);
  work.resize(padded + taps * parallel.threads());
  parallel.for_each(height_ + 2 * radius_, [&](int row, unsigned) {
    const float* from = image + reflected_index(row - radius_, height_) * width_;
    float* to = work.data() + static_cast<std::ptrdiff_t>(row) * padded_width;
    for (int column = 0; column < padded_width; ++column) to[column] = from[reflected_index(column - radius_, width_)];
  });
  const int across = (width_ + kBlock - 1) / kBlock, down = (height_ + kBlock - 1) / kBlock;
  parallel.for_each(across * down, [&](int block, unsigned thread) {
    const int left = block % across * kBlock, top = block / across * kBlock;
    float* kernel = work.data() + padded + taps * thread;
    blend(left + kBlock / 2.0, top + kBlock / 2.0, kernel);
    const int columns = std::min(kBlock, width_ - left);
    for (int row = top; row < std::min(top + kBlock, height_); ++row) {
      float sums[kBlock] = {};
      for (int y = 0; y < side; ++y) {
        const float* from = work.data() + static_cast<std::ptrdiff_t>(row + y) * padded_width + left;
        for (int x = 0; x < side; ++x) {
          const float tap = kernel[y * side + x];
          for (int column = 0; column < kBlock; ++column) sums[column] += tap * from[x + column];
        }
      }
      std::copy_n(sums, columns, blurred + row * width_ + left);
    }
  });
}

void Diffraction::blend(double column, double row, float* kernel) const {
  const Between across = between(column, width_, kZones), down = between(row, height_, kZones);
  const auto zone = [&](int i, int j) -> const Kernel& {
    return kernels_[static_cast<std::size_t>((down.zone + i) * kZones + across.zone + j)];
  };
  const Kernel &a = zone(0, 0), &b = zone(0, 1), &c = zone(1, 0), &d = zone(1, 1);
  for (std::size_t k = 0; k < a.size(); ++k)
    kernel[k] = static_cast<float>((1 - down.share) * ((1 - across.share) * a[k] + across.share * b[k]) +
                                   down.share * ((1 - across.share) * c[k] + across.share * d[k]));
}

}  // namespace relign::imaging
