#include "base/arctangent.hpp"

#include <cstddef>

#include "base/assert.hpp"

// Other versions for newer processors, chosen by hand: the loader does so (by ifunc) with the GNU C
// library alone, not with musl, and before a sanitizer is ready.
#if defined(__GNUC__) && defined(__x86_64__) && defined(__linux__)
#define SUPERFACETS_HAS_VERSIONS 1
#else
#define SUPERFACETS_HAS_VERSIONS 0
#endif

namespace superfacets {
namespace {

SUPERFACETS_ALWAYS_INLINE void loop(const double* __restrict y, const double* __restrict x,
                                    double* __restrict angles, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) angles[i] = arctangent(y[i], x[i]);
}

void baseline(const double* y, const double* x, double* angles, std::size_t n) {
  loop(y, x, angles, n);
}

#if SUPERFACETS_HAS_VERSIONS
[[gnu::target("avx2")]] void avx2(const double* y, const double* x, double* angles, std::size_t n) {
  loop(y, x, angles, n);
}

[[gnu::target("avx512f")]] void avx512(const double* y, const double* x, double* angles,
                                       std::size_t n) {
  loop(y, x, angles, n);
}
#endif

}  // namespace

InstructionSet best_instruction_set() {
#if SUPERFACETS_HAS_VERSIONS
  if (__builtin_cpu_supports("avx512f")) return InstructionSet::kAvx512;
  if (__builtin_cpu_supports("avx2")) return InstructionSet::kAvx2;
#endif
  return InstructionSet::kBaseline;
}

void arctangents(std::span<const double> y, std::span<const double> x, std::span<double> angles,
                 InstructionSet with) {
  const std::size_t n = angles.size();
  SUPERFACETS_ASSERT(y.size() == n && x.size() == n && with <= best_instruction_set());
#if SUPERFACETS_HAS_VERSIONS
  if (with == InstructionSet::kAvx512) return avx512(y.data(), x.data(), angles.data(), n);
  if (with == InstructionSet::kAvx2) return avx2(y.data(), x.data(), angles.data(), n);
#endif
  static_cast<void>(with);
  baseline(y.data(), x.data(), angles.data(), n);
}

}  // namespace superfacets
