// Threads that are kept from one kernel to the next.
#pragma once

#include <memory>

#include "base/threads.hpp"

namespace superfacets {

// While a TeamScope exists, the kernels that its thread calls share one team of threads, which the
// first of them starts. Objects that outlive a call, such as a Clustering, have their own team.
// Starting threads takes as long as most kernels on ten thousand faces.
class TeamScope {
 public:
  TeamScope();
  TeamScope(const TeamScope&) = delete;
  TeamScope& operator=(const TeamScope&) = delete;
  ~TeamScope();  // on the thread of the constructor
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
