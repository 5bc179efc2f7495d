// Which instruction set kernels that are compiled several times run with.
//
// What it is for: code whose inner loops are compiled once for each set and chosen at run time, with the same bits from
// each of them. The user's choice is RELIGN_ISA in the environment, the same for all such code.
#ifndef RELIGN_INSTRUCTION_SET_HPP
#define RELIGN_INSTRUCTION_SET_HPP

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

namespace relign {

enum class InstructionSet { generic, avx2, avx512 };

// avx2 is x86-64-v3, avx512 is x86-64-v4, as compilers define them; every processor has generic.
inline bool processor_has(InstructionSet set) {
#if defined(__x86_64__)
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  if (set == InstructionSet::avx2) return v3;
  if (set == InstructionSet::avx512)
    return v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#endif
  return set == InstructionSet::generic;
}

// The one named by RELIGN_ISA (generic, avx2 or avx512), else the best that this processor has. Throws
// std::invalid_argument where the processor does not have the one named.
inline InstructionSet chosen_instruction_set() {
  const char* set = std::getenv("RELIGN_ISA");
  const std::string wish = set ? set : "";
  for (const auto& [name, one] : {std::pair{"avx512", InstructionSet::avx512}, std::pair{"avx2", InstructionSet::avx2},
                                  std::pair{"generic", InstructionSet::generic}})
    if ((wish.empty() || wish == name) && processor_has(one)) return one;
  throw std::invalid_argument("RELIGN_ISA=" + wish +
                              ": this processor has no such instruction set; use generic, avx2 or avx512");
}

}  // namespace relign

#endif  // RELIGN_INSTRUCTION_SET_HPP
