// Loops over many numbers, compiled several times: for the baseline instruction set, and for newer
// ones.
#pragma once

#include <cstdint>

// Attribute of functions that are inlined even into a caller compiled for another instruction set.
#if defined(__GNUC__)
#define SUPERFACETS_ALWAYS_INLINE [[gnu::always_inline]] inline
#else
#define SUPERFACETS_ALWAYS_INLINE inline
#endif

// best_instruction_set selects the version. The loader could do so (ifunc), but this works with the
// GNU C library only, not with musl, and runs before a sanitizer is ready.
#if defined(__GNUC__) && defined(__x86_64__) && defined(__linux__)
#define SUPERFACETS_HAS_VERSIONS 1
#else
#define SUPERFACETS_HAS_VERSIONS 0
#endif

namespace superfacets {

// Instruction sets that a loop may be compiled for; later ones include earlier ones.
enum class InstructionSet : std::uint8_t { kBaseline, kAvx2, kAvx512 };

// The newest instruction set that loops are compiled for and this processor supports.
InstructionSet best_instruction_set();

#if SUPERFACETS_HAS_VERSIONS
template <typename Loop, typename... Arguments>
[[gnu::target("avx2")]] void run_avx2(const Loop& loop, const Arguments&... arguments) {
  loop(arguments...);
}

template <typename Loop, typename... Arguments>
[[gnu::target("avx512f,avx512dq,avx512vl")]] void run_avx512(const Loop& loop,
                                                             const Arguments&... arguments) {
  loop(arguments...);
}
#endif

// Calls loop(arguments...) as compiled for the instruction set `with`, which this processor must
// support. The call operator must be const and SUPERFACETS_ALWAYS_INLINE. All versions give the
// same bits, because no operations are fused or reordered.
template <typename Loop, typename... Arguments>
void run_version(InstructionSet with, const Loop& loop, const Arguments&... arguments) {
#if SUPERFACETS_HAS_VERSIONS
  if (with == InstructionSet::kAvx512) return run_avx512(loop, arguments...);
  if (with == InstructionSet::kAvx2) return run_avx2(loop, arguments...);
#endif
  static_cast<void>(with);
  loop(arguments...);
}

}  // namespace superfacets
