// Assertions check preconditions and invariants of kernels. Tests and sanitizers run a build with
// assertions (CMake option SUPERFACETS_ASSERT). In wheels, assertions are off and cost nothing.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace superfacets {

#if defined(SUPERFACETS_ASSERTIONS)
inline constexpr bool kHasAssertions = true;
#else
inline constexpr bool kHasAssertions = false;
#endif

// Ends the process, because a failed assertion is a bug in the core that no caller can handle.
[[noreturn]] inline void fail_assertion(const char* file, int line, const char* condition) {
  std::fprintf(stderr, "superfacets: %s:%d: assertion failed: %s\n", file, line, condition);
  std::fflush(stderr);
  std::abort();
}

// Whether all indices are in the range 0 .. n-1.
template <typename Indices>
bool all_below(const Indices& indices, std::int64_t n) {
  return std::ranges::all_of(indices, [n](std::int64_t index) { return index >= 0 && index < n; });
}

}  // namespace superfacets

// Every build compiles the condition, so that it stays valid code. Only builds with assertions
// evaluate it.
#define SUPERFACETS_ASSERT(...)                    \
  (!::superfacets::kHasAssertions || (__VA_ARGS__) \
       ? static_cast<void>(0)                      \
       : ::superfacets::fail_assertion(__FILE__, __LINE__, #__VA_ARGS__))
