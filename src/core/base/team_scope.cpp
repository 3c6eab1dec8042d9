#include "base/team_scope.hpp"

#if !defined(_WIN32)
#include <unistd.h>
#endif

namespace superfacets {
namespace {

long process_id() {
#if defined(_WIN32)
  return 0;  // Windows has no fork
#else
  return ::getpid();
#endif
}

// State of one thread: the number of open TeamScopes, and the idle team that these scopes keep
// alive.
struct Kept {
  int n_scopes = 0;
  std::unique_ptr<ThreadTeam> team;
  long process = 0;  // ID of the process in which the threads of the team run
};

thread_local Kept kept;

// Removes and returns the team that is kept for this thread. Returns null if there is no team, or
// if the team has fewer than n_threads threads. A team kept before a fork is dropped without
// calling its destructor, because its threads do not exist in this process.
std::unique_ptr<ThreadTeam> take_kept(int n_threads) {
  if (kept.team != nullptr && kept.process != process_id()) {
    const ThreadTeam* const lost = kept.team.release();
    static_cast<void>(lost);
  }
  if (kept.team == nullptr || kept.team->most() < n_threads) return nullptr;
  return std::exchange(kept.team, nullptr);
}

}  // namespace

TeamScope::TeamScope() {
  ++kept.n_scopes;
}

TeamScope::~TeamScope() {
  if (--kept.n_scopes == 0) take_kept(1).reset();
}

TeamLease::TeamLease(int n_threads) : team_(n_threads > 1 ? take_kept(n_threads) : nullptr) {
  if (team_ == nullptr) team_ = std::make_unique<ThreadTeam>(n_threads);
  team_->resize(std::min(n_threads, team_->most()));
}

TeamLease::~TeamLease() {
  if (kept.n_scopes == 0 || team_->most() == 1) return;
  kept.process = process_id();
  kept.team = std::move(team_);
}

}  // namespace superfacets
