#include "gpu/kernel_sources.h"

#define RELIGN_EMBEDDED(symbol)                     \
  extern const unsigned char relign_gpu_##symbol[]; \
  extern const unsigned long relign_gpu_##symbol##_size
extern "C" {
RELIGN_EMBEDDED(philox);
RELIGN_EMBEDDED(pi);
RELIGN_EMBEDDED(motion);
RELIGN_EMBEDDED(one_thread);
RELIGN_EMBEDDED(passing_steps);
RELIGN_EMBEDDED(direction_windows);
RELIGN_EMBEDDED(tile_start);
RELIGN_EMBEDDED(face_rings);
RELIGN_EMBEDDED(ray_ops);
RELIGN_EMBEDDED(ray_steps);
RELIGN_EMBEDDED(asphere_steps);
RELIGN_EMBEDDED(streams);
RELIGN_EMBEDDED(binomial);
RELIGN_EMBEDDED(pixel_grid);
RELIGN_EMBEDDED(tile_steps);
RELIGN_EMBEDDED(certificate_steps);
RELIGN_EMBEDDED(mse_pixel);
RELIGN_EMBEDDED(error_math);
RELIGN_EMBEDDED(pixel_steps);
RELIGN_EMBEDDED(read_out_steps);
RELIGN_EMBEDDED(tile_kernel);
RELIGN_EMBEDDED(capture_kernel);
RELIGN_EMBEDDED(ghost_block);
RELIGN_EMBEDDED(ghost_steps);
RELIGN_EMBEDDED(ghost_sensor);
RELIGN_EMBEDDED(ghost_kernel);
}

namespace relign::gpu {
namespace {

// NVRTC has no standard library: what the headers need of it.
constexpr const char* kIntegers = R"(#pragma once
namespace std {
using int32_t = int;
using int64_t = long long;
using uint16_t = unsigned short;
using uint32_t = unsigned int;
using uint64_t = unsigned long long;
}
)";
constexpr const char* kAlgorithms = R"(#pragma once
namespace std {
template <class T>
constexpr T min(T a, T b) { return b < a ? b : a; }
template <class T>
constexpr T max(T a, T b) { return a < b ? b : a; }
template <class T>
constexpr T clamp(T value, T low, T high) { return value < low ? low : high < value ? high : value; }
}
)";
constexpr const char* kArray = R"(#pragma once
namespace std {
template <class T, unsigned long long N>
struct array {
  T values[N];
  constexpr T& operator[](unsigned long long i) { return values[i]; }
  constexpr const T& operator[](unsigned long long i) const { return values[i]; }
  constexpr T* begin() { return values; }
  constexpr const T* begin() const { return values; }
  constexpr T* end() { return values + N; }
  constexpr const T* end() const { return values + N; }
  friend bool operator==(const array& a, const array& b) {
    for (unsigned long long i = 0; i < N; ++i)
      if (!(a[i] == b[i])) return false;
    return true;
  }
};
}
)";
constexpr const char* kMath = R"(#pragma once
namespace std {
using ::fabs;
using ::frexp;
using ::ldexp;
using ::sqrt;
}
)";

KernelSource source(const char* name, const unsigned char* text, unsigned long size) {
  return {name, std::string(reinterpret_cast<const char*>(text), size)};
}

}  // namespace

const std::vector<KernelSource>& kernel_sources() {
  static const std::vector<KernelSource> all = {
      {"cstdint", kIntegers},
      {"algorithm", kAlgorithms},
      {"array", kArray},
      {"cmath", kMath},
      source("relign/philox.hpp", relign_gpu_philox, relign_gpu_philox_size),
      source("optics/pi.h", relign_gpu_pi, relign_gpu_pi_size),
      source("optics/motion.h", relign_gpu_motion, relign_gpu_motion_size),
      source("optics/one_thread.h", relign_gpu_one_thread, relign_gpu_one_thread_size),
      source("optics/passing_steps.h", relign_gpu_passing_steps, relign_gpu_passing_steps_size),
      source("optics/tile_start.h", relign_gpu_tile_start, relign_gpu_tile_start_size),
      source("optics/face_rings.h", relign_gpu_face_rings, relign_gpu_face_rings_size),
      source("optics/ray_ops.h", relign_gpu_ray_ops, relign_gpu_ray_ops_size),
      source("optics/ray_steps.h", relign_gpu_ray_steps, relign_gpu_ray_steps_size),
      source("optics/asphere_steps.h", relign_gpu_asphere_steps, relign_gpu_asphere_steps_size),
      source("imaging/streams.h", relign_gpu_streams, relign_gpu_streams_size),
      source("imaging/binomial.h", relign_gpu_binomial, relign_gpu_binomial_size),
      source("imaging/pixel_grid.h", relign_gpu_pixel_grid, relign_gpu_pixel_grid_size),
      source("imaging/tile_steps.h", relign_gpu_tile_steps, relign_gpu_tile_steps_size),
      source("imaging/certificate_steps.h", relign_gpu_certificate_steps, relign_gpu_certificate_steps_size),
      source("optics/direction_windows.h", relign_gpu_direction_windows, relign_gpu_direction_windows_size),
      source("imaging/mse_pixel.h", relign_gpu_mse_pixel, relign_gpu_mse_pixel_size),
      source("imaging/error_math.h", relign_gpu_error_math, relign_gpu_error_math_size),
      source("imaging/pixel_steps.h", relign_gpu_pixel_steps, relign_gpu_pixel_steps_size),
      source("gpu/read_out_steps.h", relign_gpu_read_out_steps, relign_gpu_read_out_steps_size),
      source("gpu/tile_kernel.h", relign_gpu_tile_kernel, relign_gpu_tile_kernel_size),
      source("gpu/capture_kernel.h", relign_gpu_capture_kernel, relign_gpu_capture_kernel_size),
      source("optics/ghost_block.h", relign_gpu_ghost_block, relign_gpu_ghost_block_size),
      source("optics/ghost_steps.h", relign_gpu_ghost_steps, relign_gpu_ghost_steps_size),
      source("imaging/ghost_sensor.h", relign_gpu_ghost_sensor, relign_gpu_ghost_sensor_size),
      source("gpu/ghost_kernel.h", relign_gpu_ghost_kernel, relign_gpu_ghost_kernel_size),
  };
  return all;
}

}  // namespace relign::gpu
