// The arithmetic of importance regions (passing_table.h), for CPU and GPU: what a region is, between which places of
// its grid a point is, and how a region on a plane is found. NVRTC compiles this header.
#pragma once

#include <algorithm>
#include <array>

#include "optics/motion.h"
#include "optics/one_thread.h"

namespace relign::optics {

constexpr int kSupports = 16;
constexpr int kAzimuths = 2 * kSupports;

struct PassingRegion {
  bool empty = true;
  std::array<double, 2> middle{};            // mm on the plane, or direction cosines in lens coordinates
  std::array<double, kSupports> supports{};  // from the middle
};

// Cosines and sines of 2 pi k / kAzimuths; support k has twice the azimuth k.
struct Azimuths {
  std::array<double, kAzimuths> cosine, sine;
};

// The places of a table's regions, in lens coordinates: count x count x count_z.
struct PassingGrid {
  bool on_plane;          // else regions are in direction cosines
  double plane_z, reach;  // of the plane (pupil_search.h)
  std::int32_t count, count_z;
  double low, step;      // mm: x and y of place 0, and between places
  double low_z, step_z;  // mm

  std::int32_t places() const { return count * count * count_z; }
  Vec3 place(std::int32_t index) const {
    const std::int32_t ix = index % count, iy = index / count % count, iz = index / count / count;
    return {low + ix * step, low + iy * step, low_z + iz * step_z};
  }
};

// The grid cell that contains a point, and the position in it.
struct PassingCell {
  std::int32_t ix, iy, iz;
  double fu, fv, fw;

  // One of its eight corners: bits for x, y and z.
  std::int32_t place(const PassingGrid& grid, int corner) const {
    return ((iz + (corner >> 2)) * grid.count + iy + (corner >> 1 & 1)) * grid.count + ix + (corner & 1);
  }
  double weight(int corner) const {
    return (corner & 1 ? fu : 1 - fu) * (corner & 2 ? fv : 1 - fv) * (corner & 4 ? fw : 1 - fw);
  }
};

// False outside the range.
inline bool find_cell(const PassingGrid& grid, const Vec3& place, PassingCell& cell) {
  const double u = (place.x - grid.low) / grid.step, v = (place.y - grid.low) / grid.step,
               w = (place.z - grid.low_z) / grid.step_z;
  if (!(u >= 0 && u <= grid.count - 1 && v >= 0 && v <= grid.count - 1)) return false;
  const double wc = std::clamp(w, 0.0, grid.count_z - 1.0);
  cell.ix = std::min(static_cast<std::int32_t>(u), grid.count - 2);
  cell.iy = std::min(static_cast<std::int32_t>(v), grid.count - 2);
  cell.iz = std::min(static_cast<std::int32_t>(wc), grid.count_z - 2);
  cell.fu = u - cell.ix;
  cell.fv = v - cell.iy;
  cell.fw = wc - cell.iz;
  return true;
}

// The region at a point, interpolated between the places around it, which must have one, and widened by a margin. Empty
// outside the range and where no light passes.
inline PassingRegion region_at(const PassingGrid& grid, const PassingRegion* regions, const Vec3& place) {
  constexpr double kRelativeMargin = 0.03;  // of the supports
  constexpr double kSpreadMargin = 0.5;     // of what neighbours differ by, in direction cosines
  PassingRegion result;
  PassingCell cell;
  if (!find_cell(grid, place, cell)) return result;

  // Weighted over the corners where light passes.
  double total = 0;
  std::array<double, kSupports> lowest{}, highest{};
  for (double& value : lowest) value = 1e300;
  for (int corner = 0; corner < 8; ++corner) {
    const PassingRegion& region = regions[cell.place(grid, corner)];
    if (region.empty) continue;
    const double weight = cell.weight(corner) + 1e-9;
    total += weight;
    for (int axis = 0; axis < 2; ++axis) result.middle[axis] += weight * region.middle[axis];
    for (int k = 0; k < kSupports; ++k) {
      result.supports[k] += weight * region.supports[k];
      lowest[k] = std::min(lowest[k], region.supports[k]);
      highest[k] = std::max(highest[k], region.supports[k]);
    }
  }
  if (total == 0) return result;
  result.empty = false;
  for (double& value : result.middle) value /= total;
  double largest = 0;
  for (double& value : result.supports) {
    value /= total;
    largest = std::max(largest, value);
  }
  for (double& value : result.supports) value += kRelativeMargin * largest;
  if (!grid.on_plane)
    for (int k = 0; k < kSupports; ++k) result.supports[k] += kSpreadMargin * (highest[k] - lowest[k]);
  return result;
}

constexpr int kCoarse = 16;  // places per side of the square on the plane that is searched first
constexpr int kCoarsePlaces = kCoarse * kCoarse;

// Shared by the threads of a block that finds a region.
struct RegionSearch {
  double x[kCoarsePlaces], y[kCoarsePlaces];  // on the plane, mm
  bool passed[kCoarsePlaces];
  bool any;  // of the coarse places passed
  double middle[2];
  double inner[kAzimuths], outer[kAzimuths];
};

// Finds the region of a place on a plane. probe(count): whether the rays from the place to each (x, y) pass, into
// `passed`; by all threads of the block. The result is complete when the block has ended.
template <class Block, class Probe>
void find_region(const Block& block, const PassingGrid& grid, const Azimuths& azimuths, RegionSearch& work,
                 const Probe& probe, PassingRegion& region) {
  constexpr int kBisections = 10;
  const double cell = 2 * grid.reach / kCoarse;
  block.for_each(kCoarsePlaces, [&](std::int32_t i) {
    work.x[i] = -grid.reach + cell * (i % kCoarse + 0.5);
    work.y[i] = -grid.reach + cell * (i / kCoarse + 0.5);
  });
  probe(kCoarsePlaces);
  block.for_each(2, [&](std::int32_t axis) {
    const double* const places = axis == 0 ? work.x : work.y;
    double sum = 0;
    int count = 0;
    for (int i = 0; i < kCoarsePlaces; ++i)
      if (work.passed[i]) {
        sum += places[i];
        ++count;
      }
    work.middle[axis] = count > 0 ? sum / count : 0;
    region.middle[axis] = work.middle[axis];
    if (axis > 0) return;
    work.any = count > 0;
    region.empty = count == 0;
  });
  if (!work.any) {
    block.for_each(kSupports, [&](std::int32_t k) { region.supports[k] = 0; });
    return;
  }

  // Bisect between the middle (passes) and twice the reach (does not) along each azimuth.
  for (int step = 0; step <= kBisections; ++step) {
    block.for_each(kAzimuths, [&](std::int32_t k) {
      if (step == 0) {
        work.inner[k] = 0;
        work.outer[k] = 2 * grid.reach;
      } else {
        (work.passed[k] ? work.inner : work.outer)[k] = 0.5 * (work.inner[k] + work.outer[k]);
      }
      const double length = 0.5 * (work.inner[k] + work.outer[k]);
      work.x[k] = work.middle[0] + length * azimuths.cosine[k];
      work.y[k] = work.middle[1] + length * azimuths.sine[k];
    });
    if (step < kBisections) probe(kAzimuths);
  }
  block.for_each(kSupports, [&](std::int32_t k) {
    double support = 0;
    for (int i = 0; i < kAzimuths; ++i) {
      const double edge[2] = {work.outer[i] * azimuths.cosine[i], work.outer[i] * azimuths.sine[i]};
      support = std::max(support, edge[0] * azimuths.cosine[2 * k] + edge[1] * azimuths.sine[2 * k]);
    }
    region.supports[k] = support;
  });
}

}  // namespace relign::optics
