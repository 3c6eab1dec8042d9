// Keeps a team of threads alive from one kernel call to the next.
#pragma once

#include <memory>

#include "base/threads.hpp"

namespace superfacets {

// While a TeamScope exists, all kernels called on its thread share one team of threads. The first
// kernel starts the team. This saves time, because starting threads takes as long as most kernels
// on ten thousand faces. Objects that outlive a call, such as a Clustering, have their own team.
class TeamScope {
 public:
  TeamScope();
  TeamScope(const TeamScope&) = delete;
  TeamScope& operator=(const TeamScope&) = delete;
  ~TeamScope();  // must run on the same thread as the constructor
};

// The team of one kernel call: the team of the scope, or a new one. A kernel that is called while
// another kernel runs on the same thread gets its own team.
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
