// Stage 4a: labels from centers.
#pragma once

#include <optional>
#include <vector>

#include "clustering/islands.hpp"
#include "paths/expansion.hpp"
#include "paths/halting.hpp"

namespace superfacets {

// The classification of all places by centers. Classifying again takes time in proportion to the
// number of changes. Memory: 12 bytes per cell; with halted expansions 4 more, and 8 for each of up
// to four threads.
class Classification {
 public:
  // With an infinite `reach` the classification is exact: each place gets the nearest center, the
  // lowest label among equals, and regions are connected. A finite reach halts expansions (see
  // HaltedPaths). If islands are kept, the lowest unreached cell becomes a center until all cells
  // are reached; if not, unreached cells get kNoLabel.
  Classification(const OrderedGraph& graph, double reach, Islands islands, ThreadTeam& team);

  // Classifies by these centers.
  void classify(std::span<const Place> centers);

  // The centers of the last call, followed by unreached cells that became centers.
  std::span<const Place> centers() const { return centers_; }

  // The label of a place, which is the index of its center in `centers`, and the path from there.
  Path path(Place place) const {
    return halted_ ? halted_->path(exact_, place) : exact_.path(place);
  }

  // Calls take(begin, end), on several threads, for ranges of places whose paths may have changed
  // since the last call. All other paths are unchanged.
  template <typename Take>
  void take_changes(const Take& take) {
    team_.for_each(exact_.n_chunks(), [&](std::int64_t chunk, int) {
      // It is unknown which corrections are new, so all places are passed on.
      if (!halted_ && !exact_.has_changed(chunk)) return;
      const auto [begin, end] = exact_.places(chunk);
      take(begin, end);
      exact_.settle(chunk);
    });
  }

 private:
  bool is_complete() const;
  void start_all();
  void start_moved();
  void adopt_orphans();

  const OrderedGraph& graph_;
  const Islands islands_;
  ThreadTeam& team_;
  Expansion exact_;
  std::optional<HaltedPaths> halted_;
  std::vector<Place> centers_;
  std::vector<Place> started_;  // centers of the exact paths
  bool may_have_orphans_ = true;
};

}  // namespace superfacets
