// Stage 4: regions around centers, and updates of the centers.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "clustering/classification.hpp"
#include "clustering/update.hpp"

namespace superfacets {

// The regions of one graph, classified (4a) and updated (4b) alternately. Both keep the state of
// the last iteration, so an iteration that changes little costs little. Cells are numbered as in
// the input. Memory: 18 bytes per cell beside the graph, more with halted expansions.
class Clustering {
 public:
  // Classifies all cells by these centers; for `reach` and `islands` see Classification.
  Clustering(const OrderedGraph& graph, std::span<const Cell> centers, double reach,
             Islands islands, int n_threads);

  // Replaces the centers by as many others, in the same order, and classifies again; for the
  // offsets see Classification.
  void classify(std::span<const Cell> centers, std::span<const PathLength> offsets = {});

  // The centers of the last call, followed by unreached cells that became centers.
  std::vector<Cell> centers() const;

  // For each region the cell nearest to its mean; see update_centers.
  std::vector<Cell> update();

  // The centers, after some have moved to where they are needed more; see relocate_centers.
  // Expansions must not be halted.
  std::vector<Cell> relocate(std::int64_t n_moves);

  Buffer<Label> labels();        // (N,) index of each cell's center in `centers`, or kNoLabel
  Buffer<PathLength> lengths();  // (N,) of the path from that center

 private:
  const OrderedGraph& graph_;
  ThreadTeam team_;
  Classification classification_;
  RegionMeans means_;
};

}  // namespace superfacets
