#include "base/versions.hpp"

namespace superfacets {

InstructionSet best_instruction_set() {
#if SUPERFACETS_HAS_VERSIONS
  // The results are cached, because querying the processor is slow compared with a short loop.
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
