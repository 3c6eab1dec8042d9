// A thread that is joined before it goes out of scope.
#pragma once

#include <thread>
#include <utility>

namespace superfacets {

// Replaces std::jthread, which libc++ (macOS) offers only from version 20 on. Has no stop token.
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

}  // namespace superfacets
