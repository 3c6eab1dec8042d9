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

  // Classifies by these centers. With `offsets`, one for each center, paths from a center begin
  // with its offset: a center may then be in the region of another, and have no cell. They must be
  // at least those of the last call, and expansions not halted.
  void classify(std::span<const Place> centers, std::span<const PathLength> offsets = {});

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
  PathLength offset(std::size_t label) const {
    return label < offsets_.size() ? offsets_[label] : PathLength{0};
  }
  void start_all();
  void start_moved(std::span<const PathLength> offsets_before);
  void adopt_orphans();

  const OrderedGraph& graph_;
  const Islands islands_;
  ThreadTeam& team_;
  Expansion exact_;
  std::optional<HaltedPaths> halted_;
  std::vector<Place> centers_;
  std::vector<Place> started_;       // centers of the exact paths
  std::vector<PathLength> offsets_;  // of the centers; 0 for those without one
  bool may_have_orphans_ = true;
};

}  // namespace superfacets
