// Stage 4: regions around centers, and where their centers should be.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "clustering/classification.hpp"
#include "clustering/update.hpp"

namespace superfacets {

// The regions of one graph, classified (4a) and updated (4b) in turn. It keeps what both know of
// the last iteration, so that one that changes little costs little. Cells are numbered as in the
// input. Memory: 18 bytes a cell beside the graph, more where expansions are halted.
class Clustering {
 public:
  // Classifies all cells by these centers; for `reach` and `islands` see Classification.
  Clustering(const OrderedGraph& graph, std::span<const Cell> centers, double reach,
             Islands islands, int n_threads);

  // Classifies them by these instead: as many as centers(), in the same order.
  void classify(std::span<const Cell> centers);

  // The centers given last, then those made of cells that none of them reached.
  std::vector<Cell> centers() const;

  // For each region the cell nearest to its mean; see update_centers.
  std::vector<Cell> update();

  Buffer<Label> labels();        // (N,) the place in `centers` of each cell's center, or kNoLabel
  Buffer<PathLength> lengths();  // (N,) of the path from there

 private:
  const OrderedGraph& graph_;
  ThreadTeam team_;
  Classification classification_;
  RegionMeans means_;
};

}  // namespace superfacets
