// Compiles a loop once per instruction set, and selects the best version at run time.
#pragma once

#include <cstdint>

// Attribute that inlines a function even if the caller is compiled for another instruction set.
#if defined(__GNUC__)
#define SUPERFACETS_ALWAYS_INLINE [[gnu::always_inline]] inline
#else
#define SUPERFACETS_ALWAYS_INLINE inline
#endif

// The version is selected at run time, by best_instruction_set. Selection by the loader (ifunc)
// does not work with musl, and would run before sanitizers are initialized.
#if defined(__GNUC__) && defined(__x86_64__) && defined(__linux__)
#define SUPERFACETS_HAS_VERSIONS 1
#else
#define SUPERFACETS_HAS_VERSIONS 0
#endif

namespace superfacets {

// Instruction sets for which loops are compiled. Each one includes the previous ones.
enum class InstructionSet : std::uint8_t { kBaseline, kAvx2, kAvx512 };

// Returns the newest of these instruction sets that the processor supports.
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

// Calls the version of loop(arguments...) that is compiled for the instruction set `with`. The
// processor must support this instruction set. The call operator of `loop` must be const and
// SUPERFACETS_ALWAYS_INLINE. All versions give bit-identical results, because no operations are
// fused or reordered.
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
