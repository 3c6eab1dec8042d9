// Stage 4: computes regions around centers, and updates the centers.
#pragma once

#include "clustering/classification.hpp"
#include "clustering/update.hpp"

namespace superfacets {

// The regions of a graph. Callers alternate classify() (stage 4a) and update() (stage 4b). Both
// stages keep the state of the last iteration, so an iteration with few changes takes little time.
// All arguments and results refer to cells by their index in the input. Uses 18 bytes per cell in
// addition to the graph, and more if `reach` is finite.
class Clustering {
 public:
  // Assigns all cells to the given centers. See Classification for the other arguments.
  Clustering(const OrderedGraph& graph, std::span<const Cell> centers, double reach,
             Islands islands, PathArrays* paths, int n_threads);

  // Replaces the K centers by K new centers, and assigns all cells again.
  void classify(std::span<const Cell> centers);

  // The centers of the last call, followed by unreached cells that became centers.
  std::vector<Cell> centers() const;

  // Returns for each region the cell nearest to the mean position of the region; see
  // update_centers.
  std::vector<Cell> update();

  // Moves up to n_moves centers to reduce the distortion (see relocate_centers), and returns all
  // centers. Requires an infinite `reach`.
  std::vector<Cell> relocate(std::int64_t n_moves, ThreadTeam& team);

  const OrderedGraph& graph() const { return graph_; }

  Buffer<Label> labels();        // (N,) index of each cell's center in centers(), or kNoLabel
  Buffer<PathLength> lengths();  // (N,) length of the path from that center to each cell

 private:
  const OrderedGraph& graph_;
  ThreadTeam team_;
  Classification classification_;
  RegionMeans means_;
};

}  // namespace superfacets
