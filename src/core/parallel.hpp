// Loops over independent elements, on several threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <span>
#include <system_error>
#include <thread>
#include <vector>

namespace superfacets {

// Work below this size is done before a second thread would have started.
inline constexpr std::int64_t kMinPerThread = 1 << 14;

// The number of threads, n_threads at most, that are worth starting for n elements.
inline int useful_threads(std::int64_t n, int n_threads,
                          std::int64_t min_per_thread = kMinPerThread) {
  return static_cast<int>(std::clamp<std::int64_t>(n / min_per_thread, 1, n_threads));
}

// Calls work(begin, end) for consecutive parts of 0..n-1, one per thread. The parts depend on
// n_threads, so work must give the same result however the range is cut. Where a thread cannot be
// started its part is done here; the first exception that a part throws is thrown when all are
// done.
template <typename Work>
void parallel_ranges(std::int64_t n, int n_threads, const Work& work,
                     std::int64_t min_per_thread = kMinPerThread) {
  const std::int64_t n_parts = useful_threads(n, n_threads, min_per_thread);
  std::vector<std::exception_ptr> failures(n_parts);
  auto run_part = [&](std::int64_t part) noexcept {
    try {
      work(n * part / n_parts, n * (part + 1) / n_parts);
    } catch (...) {
      failures[part] = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    helpers.reserve(n_parts);
    for (std::int64_t part = 1; part < n_parts; ++part) {
      try {
        helpers.emplace_back(run_part, part);
      } catch (const std::system_error&) {
        run_part(part);
      }
    }
    run_part(0);
  }  // waits for the helpers
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

// Fills an array, of which each thread then has touched a part first.
template <typename T>
void parallel_fill(std::span<T> values, T value, int n_threads) {
  const auto n = static_cast<std::int64_t>(values.size());
  parallel_ranges(n, n_threads, [&](std::int64_t begin, std::int64_t end) {
    std::fill(values.begin() + begin, values.begin() + end, value);
  });
}

}  // namespace superfacets
