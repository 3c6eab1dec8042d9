// Loops over independent elements, on several threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <thread>
#include <vector>

namespace superfacets {

// Work below this size is done before a second thread would have started.
inline constexpr std::int64_t kMinPerThread = 1 << 14;

// Calls work(begin, end) for consecutive parts of 0..n-1, one per thread. The parts depend on
// n_threads, so work must give the same result however the range is cut.
template <typename Work>
void parallel_ranges(std::int64_t n, int n_threads, const Work& work,
                     std::int64_t min_per_thread = kMinPerThread) {
  const std::int64_t useful = std::max<std::int64_t>(1, n / min_per_thread);
  const std::int64_t n_parts = std::min<std::int64_t>(n_threads, useful);
  std::vector<std::jthread> helpers;
  for (std::int64_t part = 1; part < n_parts; ++part) {
    helpers.emplace_back(
        [&work, n, part, n_parts] { work(n * part / n_parts, n * (part + 1) / n_parts); });
  }
  work(std::int64_t{0}, n / n_parts);
}

}  // namespace superfacets
