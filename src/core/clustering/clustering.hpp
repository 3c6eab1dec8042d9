// Stage 4: computes regions around centers, and updates the centers.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "clustering/classification.hpp"
#include "clustering/update.hpp"

namespace superfacets {

// The regions of one graph. Callers alternate classification (4a) and update (4b). Both stages keep
// the state of the last iteration, so an iteration with few changes takes little time. Cells are
// indices in the input. Memory: 18 bytes per cell in addition to the graph, more with halted
// expansions.
class Clustering {
 public:
  // Classifies all cells by these centers; for `reach` and `islands` see Classification.
  Clustering(const OrderedGraph& graph, std::span<const Cell> centers, double reach,
             Islands islands, int n_threads);

  // Replaces each center by a new one, (K,), and classifies again. For offsets see Classification.
  void classify(std::span<const Cell> centers, std::span<const PathLength> offsets = {});

  // The centers of the last call, followed by unreached cells that became centers.
  std::vector<Cell> centers() const;

  // For each region, the cell nearest to the mean position of the region; see update_centers.
  std::vector<Cell> update();

  // Moves up to n_moves centers to reduce the distortion (see relocate_centers), and returns all
  // centers. Expansions must not be halted.
  std::vector<Cell> relocate(std::int64_t n_moves, ThreadTeam& team);

  const OrderedGraph& graph() const { return graph_; }

  Buffer<Label> labels();        // (N,) index of each cell's center in `centers`, or kNoLabel
  Buffer<PathLength> lengths();  // (N,) length of the path from that center

 private:
  const OrderedGraph& graph_;
  ThreadTeam team_;
  Classification classification_;
  RegionMeans means_;
};

}  // namespace superfacets
