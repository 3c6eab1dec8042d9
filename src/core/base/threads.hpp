// A team of threads for loops over independent elements, and sums that do not depend on the number
// of threads.
#pragma once

#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "base/assert.hpp"

namespace superfacets {

// Minimum number of elements per thread. For fewer elements, starting a thread takes longer than
// the work.
inline constexpr std::int64_t kMinPerThread = 1 << 14;

// Minimum number of elements per thread for slow loops, in which an element takes about ten times
// as long as in other loops. An example is a loop that visits 20 arcs of each cell.
inline constexpr std::int64_t kMinSlowPerThread = 1 << 11;

// The number of threads, at most n_threads, that are worth starting for n elements.
inline int useful_threads(std::int64_t n, int n_threads,
                          std::int64_t min_per_thread = kMinPerThread) {
  SUPERFACETS_ASSERT(n >= 0 && n_threads >= 1);
  return static_cast<int>(std::clamp<std::int64_t>(n / min_per_thread, 1, n_threads));
}

// A thread that is joined by its destructor. Replaces std::jthread, which libc++ (macOS) lacks
// before version 20.
class JoiningThread {
 public:
  template <typename Work, typename... Arguments>
  explicit JoiningThread(Work&& work, Arguments&&... arguments)
      : thread_(std::forward<Work>(work), std::forward<Arguments>(arguments)...) {}
  JoiningThread(JoiningThread&&) noexcept = default;
  JoiningThread& operator=(JoiningThread&&) = delete;
  ~JoiningThread() {
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::thread thread_;
};

// A team consists of the calling thread and n_threads - 1 helpers. The team has fewer helpers if
// the system cannot start more threads.
class ThreadTeam {
 public:
  explicit ThreadTeam(int n_threads) {
    n_threads = std::min(n_threads, static_cast<int>(kClosing));
    helpers_.reserve(n_threads);
    for (int helper = 1; helper < n_threads; ++helper) {
      try {
        helpers_.emplace_back([this, helper] { serve(helper); });
      } catch (const std::exception&) {
        break;  // the system cannot start more threads
      }
    }
    n_active_ = static_cast<int>(helpers_.size());
  }
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;
  ~ThreadTeam() { start_helpers(kClosing); }

  // Number of threads that take part in loops.
  int size() const { return n_active_ + 1; }
  // Number of threads that were started, an upper bound of size().
  int most() const { return static_cast<int>(helpers_.size()) + 1; }
  // Limits later loops to n_threads <= most() threads.
  void resize(int n_threads) {
    SUPERFACETS_ASSERT(n_threads >= 1 && n_threads <= most() && n_busy_ == 0);
    n_active_ = n_threads - 1;
  }

  // Calls work(task, thread) for each task 0..n_tasks-1, with thread in 0..size()-1. The assignment
  // of tasks to threads varies between runs, so results must not depend on it. The first exception
  // is rethrown when all threads are done.
  template <typename Work>
  void for_each(std::int64_t n_tasks, const Work& work) {
    if (n_active_ == 0 || n_tasks <= 1) {
      for (std::int64_t task = 0; task < n_tasks; ++task) work(task, 0);
      return;
    }
    SUPERFACETS_ASSERT(n_busy_ == 0);  // a task must not start another loop
    work_ = &work;
    call_ = [](const void* any_work, std::int64_t task, int thread) {
      (*static_cast<const Work*>(any_work))(task, thread);
    };
    n_tasks_ = n_tasks;
    next_task_.store(0, std::memory_order_relaxed);
    n_busy_.store(n_active_, std::memory_order_relaxed);
    start_helpers(static_cast<std::uint32_t>(n_active_));
    take_tasks(0);
    wait_while(n_busy_, [](int n_busy) { return n_busy > 0; });
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

  // Calls work(begin, end) for blocks of 0..n-1, on any thread. The blocks do not depend on the
  // number of threads.
  template <typename Work>
  void for_each_block(std::int64_t n, const Work& work, std::int64_t block = kBlock) {
    for_each((n + block - 1) / block,
             [&](std::int64_t task, int) { work(task * block, std::min(n, (task + 1) * block)); });
  }

  // Calls work(i) for each i in 0..n-1, in blocks, on any thread.
  template <typename Work>
  void for_each_index(std::int64_t n, const Work& work, std::int64_t block = kBlock) {
    const auto each = [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t i = begin; i < end; ++i) call(&Work::operator(), work, i);
    };
    for_each_block(n, each, block);
  }

  // Like for_each_index, with smaller blocks for slow loops; see kMinSlowPerThread.
  template <typename Work>
  void for_each_slow(std::int64_t n, const Work& work) {
    for_each_index(n, work, kMinSlowPerThread / 4);
  }

  // Fills an array on all threads. A page is placed near the thread that first writes to it, so the
  // pages are spread over the memory of all processors.
  template <typename T>
  void fill(std::span<T> values, T value) {
    for_each_block(static_cast<std::int64_t>(values.size()),
                   [&](std::int64_t begin, std::int64_t end) {
                     std::fill(values.begin() + begin, values.begin() + end, value);
                   });
  }

 private:
  // Calls work(i) with i converted to the type of its parameter.
  template <typename Work, typename Index>
  static void call(void (Work::*)(Index) const, const Work& work, std::int64_t i) {
    work(static_cast<Index>(i));
  }

  // Number of elements per task. A task of simple work takes about ten microseconds.
  static constexpr std::int64_t kBlock = 1 << 14;

  // generation_ equals (loop number) * kGeneration + (number of helpers).
  static constexpr std::uint32_t kGeneration = 1 << 13;
  // Special number of helpers that tells all helper threads to exit.
  static constexpr std::uint32_t kClosing = kGeneration - 1;

  // Number of polls before a thread sleeps. These polls take about fifty microseconds, as long as
  // waking a sleeping thread. Loops usually follow each other within microseconds.
  static constexpr int kLooksBeforeSleep = 20'000;

  template <typename Value, typename Condition>
  static Value wait_while(const std::atomic<Value>& value, const Condition& must_wait) {
    Value seen = value.load(std::memory_order_acquire);
    for (int look = 0; must_wait(seen); ++look) {
      if (look >= kLooksBeforeSleep) value.wait(seen, std::memory_order_acquire);
      seen = value.load(std::memory_order_acquire);
    }
    return seen;
  }

  // Starts a loop by storing one atomic number, which includes the number of helpers that take
  // part. Helpers that do not take part read only this number, so the next loop can be prepared
  // while they read.
  //
  // The store is seq_cst, so that it is visible before notify_all checks for sleeping helpers. With
  // a weaker order, a helper that falls asleep in between would never wake.
  void start_helpers(std::uint32_t n_active) {
    const std::uint32_t last = generation_.load(std::memory_order_relaxed);
    generation_.store(((last / kGeneration + 1) * kGeneration) | n_active,
                      std::memory_order_seq_cst);
    generation_.notify_all();
  }

  void serve(int helper) {
    for (std::uint32_t done = 0;;) {
      done = wait_while(generation_, [done](std::uint32_t now) { return now == done; });
      const std::uint32_t n_active = done % kGeneration;
      if (n_active == kClosing) return;
      if (std::cmp_greater(helper, n_active)) continue;
      take_tasks(helper);
      if (n_busy_.fetch_sub(1, std::memory_order_seq_cst) == 1) n_busy_.notify_one();
    }
  }

  void take_tasks(int thread) noexcept {
    try {
      for (;;) {
        const std::int64_t task = next_task_.fetch_add(1, std::memory_order_relaxed);
        if (task >= n_tasks_) return;
        call_(work_, task, thread);
      }
    } catch (...) {
      const std::scoped_lock lock(failure_mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
  }

  // The body of the current loop. The loop body is set before generation_ increases, and helpers
  // read it afterwards.
  const void* work_ = nullptr;
  void (*call_)(const void*, std::int64_t, int) = nullptr;
  std::int64_t n_tasks_ = 0;
  int n_active_ = 0;

  std::atomic<std::int64_t> next_task_ = 0;
  std::atomic<std::uint32_t> generation_ = 0;  // loop number and number of helpers; see kGeneration
  std::atomic<int> n_busy_ = 0;                // helpers that still work on the current loop
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  // The last member is destroyed first, so threads are joined before other members are destroyed.
  std::vector<JoiningThread> helpers_;
};

// One object per thread of a team, created on first use.
template <typename T>
class PerThread {
 public:
  explicit PerThread(std::size_t n_threads) : objects_(n_threads) {}

  template <typename... Arguments>
  T& get(std::int64_t thread, const Arguments&... arguments) {
    std::optional<T>& object = objects_[thread];
    return object.has_value() ? *object : object.emplace(arguments...);
  }

 private:
  std::vector<std::optional<T>> objects_;
};

// Number of terms per partial sum. The number is fixed, so sums do not depend on the number of
// threads.
inline constexpr std::int64_t kSumBlock = 4096;

// Returns the total of sum(begin, end) over blocks of 0..n-1, added in the order of the blocks.
template <typename Sum>
double sum_of_blocks(std::int64_t n, const Sum& sum, ThreadTeam& team) {
  std::vector<double> partial((n + kSumBlock - 1) / kSumBlock);
  team.for_each_block(
      n,
      [&](std::int64_t begin, std::int64_t end) { partial[begin / kSumBlock] = sum(begin, end); },
      kSumBlock);
  double total = 0.0;
  for (const double part : partial) total += part;
  return total;
}

// Returns the sum of term(i) over 0..n-1. The terms of a block are added one after the other.
template <typename Term>
double sum_over(std::int64_t n, const Term& term, ThreadTeam& team) {
  const auto add_range = [&](std::int64_t begin, std::int64_t end) {
    double sum = 0.0;
    for (std::int64_t i = begin; i < end; ++i) sum += term(i);
    return sum;
  };
  return sum_of_blocks(n, add_range, team);
}

inline double sum_of(std::span<const double> values, ThreadTeam& team) {
  return sum_over(
      static_cast<std::int64_t>(values.size()), [&](std::int64_t i) { return values[i]; }, team);
}

}  // namespace superfacets
