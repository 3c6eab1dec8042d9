// Threads that are kept from one kernel to the next.
#pragma once

#include <memory>

#include "base/threads.hpp"

namespace superfacets {

// While one lives, the kernels that its thread calls share one team of threads, which the first of
// them starts; objects that live longer than a call have their own. Starting threads takes as long
// as most kernels on ten thousand faces.
class TeamScope {
 public:
  TeamScope();
  TeamScope(const TeamScope&) = delete;
  TeamScope& operator=(const TeamScope&) = delete;
  ~TeamScope();  // on the same thread
};

// The team of a kernel: that of the scope, or a new one. A kernel that is called while another of
// the same thread runs has a team of its own.
class TeamLease {
 public:
  explicit TeamLease(int n_threads);
  TeamLease(const TeamLease&) = delete;
  TeamLease& operator=(const TeamLease&) = delete;
  ~TeamLease();

  ThreadTeam& team() { return *team_; }

 private:
  std::unique_ptr<ThreadTeam> team_;
};

}  // namespace superfacets
