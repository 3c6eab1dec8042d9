// Stage 4a: labels from centers.
#pragma once

#include "types.hpp"

namespace superfacets {

struct Classification {
  std::vector<Label> labels;        // (N,) the nearest center's place in `centers`
  std::vector<PathLength> lengths;  // (N,) the shortest path from it
  std::vector<Cell> centers;        // (K,) those given, then one for each orphan that became one
};

// A classification that somebody else owns.
struct ClassificationView {
  std::span<const Label> labels;
  std::span<const PathLength> lengths;
  std::span<const Cell> centers;
};

// The true nearest center of every cell, the lower label among equals; regions are connected. A
// component without a center gets one, at its lowest cell. Time O((N + M) log N) at worst.
Classification classify_exact(const CellGraph& graph, std::span<const Cell> centers);

// The same after centers have moved, from the labels and lengths that belong to `previous` centers,
// as many as now: only the regions whose center moved are erased and grown again, and those around
// give way to them. Time O(N) plus what grows.
Classification reclassify_exact(const CellGraph& graph, std::span<const Cell> centers,
                                const ClassificationView& previous);

// The paper's classification: each center expands on its own by Dijkstra's algorithm. A cell
// farther than `reach` (Euclidean) from the center is labeled but not expanded. Where expansions
// overlap the shorter path wins, the lower label among equals. While there are cells that no center
// reached, the lowest of them becomes a center and expands likewise. Regions may be disconnected.
// Memory: 20 bytes per cell and thread, on four threads at most.
Classification classify_halted(const CellGraph& graph, std::span<const Cell> centers, double reach,
                               int n_threads);

}  // namespace superfacets
