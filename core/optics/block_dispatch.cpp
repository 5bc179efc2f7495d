#include <cstdlib>
#include <cstring>
#include <string>

#include "base/error.h"
#include "optics/ray_block.h"

namespace relign::optics {

const BlockKernels* block_kernels(const char* name) {
  if (std::strcmp(name, "generic") == 0) return &generic::kernels();
#if defined(__x86_64__)
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  if (std::strcmp(name, "avx2") == 0 && v3) return &avx2::kernels();
  const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  if (std::strcmp(name, "avx512") == 0 && v4) return &avx512::kernels();
#endif
  return nullptr;
}

const BlockKernels& block_kernels() {
  static const BlockKernels& chosen = []() -> const BlockKernels& {
    if (const char* wish = std::getenv("RELIGN_ISA"); wish && *wish) {
      if (const BlockKernels* kernels = block_kernels(wish)) return *kernels;
      throw Error(ErrorKind::bad_input,
                  "RELIGN_ISA=" + std::string(wish) +
                      ": this processor has no such instruction set; use generic, avx2 or avx512");
    }
    for (const char* name : {"avx512", "avx2"})
      if (const BlockKernels* kernels = block_kernels(name)) return *kernels;
    return generic::kernels();
  }();
  return chosen;
}

}  // namespace relign::optics
