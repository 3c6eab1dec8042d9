// Stage 4a: computes labels from centers.
#pragma once

#include "clustering/islands.hpp"
#include "paths/expansion.hpp"
#include "paths/halting.hpp"

namespace superfacets {

// The classification of all places by centers. The time of a repeated classification is
// proportional to the number of changes. Memory: 12 bytes per cell. Halted expansions take 4 more
// bytes, plus 8 bytes for each of up to four threads.
class Classification {
 public:
  // With an infinite `reach` the classification is exact: each place gets the label of the nearest
  // center, ties go to the lowest label, and regions are connected. A finite reach halts expansions
  // (see HaltedPaths). If islands are kept, the lowest unreached cell becomes a center, repeatedly,
  // until all cells are reached. Otherwise unreached cells get kNoLabel.
  Classification(const OrderedGraph& graph, double reach, Islands islands, ThreadTeam& team);

  // Classifies all places by these centers. `offsets` holds the initial path length of each center.
  // With offsets, a center may be in the region of another center and have no cell. An offset must
  // not be less than in the last call, and expansions must not be halted.
  void classify(std::span<const Place> centers, std::span<const PathLength> offsets = {});

  // The centers of the last call, followed by unreached cells that became centers.
  std::span<const Place> centers() const { return centers_; }

  // The path to a place from its center. Its label is the index of the center in `centers`.
  Path path(Place place) const {
    return halted_ ? halted_->path(exact_, place) : exact_.path(place);
  }

  // Calls take(begin, end), on several threads, for ranges of places whose paths may have changed
  // since the last call. All other paths are unchanged.
  template <typename Take>
  void take_changes(const Take& take) {
    team_.for_each(exact_.n_chunks(), [&](std::int64_t chunk, int) {
      // Halted expansions do not record which corrections are new, so `take` gets all places.
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
  std::vector<PathLength> offsets_;  // offset of each center; 0 if none was given
  bool may_have_orphans_ = true;
};

}  // namespace superfacets
