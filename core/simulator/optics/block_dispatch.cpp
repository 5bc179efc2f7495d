#include <cstring>
#include <relign/instruction_set.hpp>
#include <stdexcept>

#include "base/error.h"
#include "optics/ray_block.h"

namespace relign::optics {
namespace {

const BlockKernels* kernels_of(InstructionSet set) {
  if (!processor_has(set)) return nullptr;
#if defined(__x86_64__)
  if (set == InstructionSet::avx512) return &avx512::kernels();
  if (set == InstructionSet::avx2) return &avx2::kernels();
#endif
  return &generic::kernels();
}

}  // namespace

const BlockKernels* block_kernels(const char* name) {
  if (std::strcmp(name, "generic") == 0) return kernels_of(InstructionSet::generic);
  if (std::strcmp(name, "avx2") == 0) return kernels_of(InstructionSet::avx2);
  if (std::strcmp(name, "avx512") == 0) return kernels_of(InstructionSet::avx512);
  return nullptr;
}

const BlockKernels& block_kernels() {
  static const BlockKernels& chosen = []() -> const BlockKernels& {
    try {
      return *kernels_of(chosen_instruction_set());
    } catch (const std::invalid_argument& error) {
      throw Error(ErrorKind::bad_input, error.what());
    }
  }();
  return chosen;
}

}  // namespace relign::optics
