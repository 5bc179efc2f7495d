#include "gpu/kernel_sources.h"

#define RELIGN_EMBEDDED(symbol)                     \
  extern const unsigned char relign_gpu_##symbol[]; \
  extern const unsigned long relign_gpu_##symbol##_size
extern "C" {
RELIGN_EMBEDDED(philox);
RELIGN_EMBEDDED(face_rings);
RELIGN_EMBEDDED(ray_ops);
RELIGN_EMBEDDED(ray_steps);
RELIGN_EMBEDDED(asphere_steps);
RELIGN_EMBEDDED(streams);
RELIGN_EMBEDDED(mse_pixel);
RELIGN_EMBEDDED(error_math);
RELIGN_EMBEDDED(pixel_steps);
RELIGN_EMBEDDED(read_out_steps);
RELIGN_EMBEDDED(capture_kernel);
}

namespace relign::gpu {
namespace {

// NVRTC has no standard library.
constexpr const char* kStandardIntegers =
    "#pragma once\n"
    "namespace std {\n"
    "using int32_t = int;\n"
    "using uint16_t = unsigned short;\n"
    "using uint32_t = unsigned int;\n"
    "using uint64_t = unsigned long long;\n"
    "}\n";

KernelSource source(const char* name, const unsigned char* text, unsigned long size) {
  return {name, std::string(reinterpret_cast<const char*>(text), size)};
}

}  // namespace

const std::vector<KernelSource>& kernel_sources() {
  static const std::vector<KernelSource> all = {
      {"cstdint", kStandardIntegers},
      source("relign/philox.hpp", relign_gpu_philox, relign_gpu_philox_size),
      source("optics/face_rings.h", relign_gpu_face_rings, relign_gpu_face_rings_size),
      source("optics/ray_ops.h", relign_gpu_ray_ops, relign_gpu_ray_ops_size),
      source("optics/ray_steps.h", relign_gpu_ray_steps, relign_gpu_ray_steps_size),
      source("optics/asphere_steps.h", relign_gpu_asphere_steps, relign_gpu_asphere_steps_size),
      source("imaging/streams.h", relign_gpu_streams, relign_gpu_streams_size),
      source("imaging/mse_pixel.h", relign_gpu_mse_pixel, relign_gpu_mse_pixel_size),
      source("imaging/error_math.h", relign_gpu_error_math, relign_gpu_error_math_size),
      source("imaging/pixel_steps.h", relign_gpu_pixel_steps, relign_gpu_pixel_steps_size),
      source("gpu/read_out_steps.h", relign_gpu_read_out_steps, relign_gpu_read_out_steps_size),
      source("gpu/capture_kernel.h", relign_gpu_capture_kernel, relign_gpu_capture_kernel_size),
  };
  return all;
}

}  // namespace relign::gpu
