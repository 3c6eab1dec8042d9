// Stage 4a: computes labels from centers, on each graph on which the loop runs. After the loop on
// coarse graphs, CoarseGraph::spread labels the cells of finer graphs.
#pragma once

#include "clustering/islands.hpp"
#include "paths/halting.hpp"

namespace superfacets {

// Assigns each cell of a graph to the center with the shortest path, and updates this assignment
// when centers move. An update takes time proportional to the number of cells whose path changes.
// Uses 12 bytes per cell. With a finite `reach`, it uses 4 more bytes per cell, and 8 bytes per
// cell for each of up to four threads.
class Classification {
 public:
  // If `reach` is infinite, the classification is exact: each cell gets the label of the nearest
  // center (the lowest label if several centers are equally near), and regions are connected. A
  // finite `reach` limits the Euclidean distance at which paths are continued (see HaltedPaths). If
  // `islands` is kKeep, the lowest unreached cell becomes a center, repeatedly, until all cells are
  // reached. Otherwise, unreached cells get kNoLabel. `paths`, if not null, are the exact paths
  // from the centers of the first call of classify; its arrays are moved.
  Classification(const OrderedGraph& graph, double reach, Islands islands, PathArrays* paths,
                 ThreadTeam& team);

  // Assigns all cells to the given centers.
  void classify(std::span<const Place> centers);

  // The centers of the last call, followed by unreached cells that became centers.
  std::span<const Place> centers() const { return centers_; }

  // The path from the nearest center to a cell. Its label is the index of the center in centers().
  Path path(Place place) const {
    return halted_ ? halted_->path(exact_, place) : exact_.path(place);
  }

  // Calls take(begin, end), on several threads, for ranges of cells whose paths may have changed
  // since the last call. Paths outside these ranges are unchanged.
  template <typename Take>
  void take_changes(const Take& take) {
    team_.for_each(exact_.n_chunks(), [&](std::int64_t chunk, int) {
      // HaltedPaths does not record which paths have changed, so all cells are visited if paths are
      // halted.
      if (!halted_ && !exact_.has_changed(chunk)) return;
      const auto [begin, end] = exact_.places(chunk);
      take(begin, end);
      exact_.clear_changed(chunk);
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
  std::vector<Place> started_;  // centers from which exact_ was last run
  bool has_paths_;              // whether exact_ has the paths for the first call of classify
  bool may_have_orphans_ = true;
};

}  // namespace superfacets
