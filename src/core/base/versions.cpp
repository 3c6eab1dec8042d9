#include "base/versions.hpp"

namespace superfacets {

InstructionSet best_instruction_set() {
#if SUPERFACETS_HAS_VERSIONS
  // What a processor offers does not change, and asking takes as long as some numbers.
  static const bool has_avx512 = __builtin_cpu_supports("avx512f") &&
                                 __builtin_cpu_supports("avx512dq") &&
                                 __builtin_cpu_supports("avx512vl");
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx512) return InstructionSet::kAvx512;
  if (has_avx2) return InstructionSet::kAvx2;
#endif
  return InstructionSet::kBaseline;
}

}  // namespace superfacets
