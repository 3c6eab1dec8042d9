// Stage 4a: labels from centers.
#pragma once

#include <optional>
#include <vector>

#include "clustering/islands.hpp"
#include "paths/expansion.hpp"
#include "paths/halting.hpp"

namespace superfacets {

// The classification of all places by centers, and by others after that: what it costs then depends
// on what changes. Memory: 12 bytes a cell; where expansions are halted 4 more, and 8 for each of
// up to four threads.
class Classification {
 public:
  // An infinite `reach` means exactly: the true nearest center, the lower label among equals;
  // regions are connected. A finite one halts expansions (see HaltedPaths). Where islands are kept,
  // the lowest cell that no center reaches becomes one, until all are reached; where not, such
  // cells have kNoLabel.
  Classification(const OrderedGraph& graph, double reach, Islands islands, ThreadTeam& team);

  // Classifies by these centers.
  void classify(std::span<const Place> centers);

  // The centers given last, then those made of cells that none of them reached.
  std::span<const Place> centers() const { return centers_; }

  // The label of a place, which is the place in `centers` of its center, and the path from there.
  Path path(Place place) const {
    return halted_ ? halted_->path(exact_, place) : exact_.path(place);
  }

  // Calls take(begin, end) for ranges of places, on several threads; paths of all others are as
  // they were when this was called last.
  template <typename Take>
  void take_changes(const Take& take) {
    team_.for_each(exact_.n_chunks(), [&](std::int64_t chunk, int) {
      // Which of the corrections are new is not known.
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
  std::vector<Place> started_;  // centers that exact paths lead from
  bool may_have_orphans_ = true;
};

}  // namespace superfacets
