// The headers that NVRTC compiles, as they were when this program was built.
#pragma once

#include <string>
#include <vector>

namespace relign::gpu {

struct KernelSource {
  std::string name;  // as it is included
  std::string text;
};

// All that gpu/ghost_kernel.h includes, itself too.
const std::vector<KernelSource>& kernel_sources();

}  // namespace relign::gpu
