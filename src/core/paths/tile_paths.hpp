// Shortest paths on a graph that is too large for one expansion: tile by tile.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Paths by place.
struct TilePaths {
  Buffer<PathLength> lengths;
  Buffer<Label> labels;
};

// Paths that are proposed to places.
struct PathProposals {
  std::span<const Place> places;
  std::span<const PathLength> lengths;
  std::span<const Label> labels;  // >= 0
};

// The arcs that leave the cells of a tile, to each other and to its rim: cells of other tiles,
// which come behind them and have no arcs here.
struct PathArcs {
  std::span<const std::int64_t> offsets;  // (number of own cells + 1,)
  std::span<const Place> targets;
  std::span<const float> lengths;  // whole units >= 1
};

// A graph of these, for what asks for arcs alone: it has no positions. n_cells is the number of
// cells of the tile and its rim.
OrderedGraph graph_of_arcs(const PathArcs& input, std::size_t n_cells);

// The best paths to the cells of a tile and to its rim, from those known before (which no arc of
// the tile improves) and from what is proposed. Where a path to the rim is better than before, it
// is to be proposed to the tile that owns the cell. When nothing is left to propose, no arc of any
// tile improves a path, so all have the best of all paths, as after one expansion on the whole
// graph, in whatever order tiles came.
TilePaths improve_paths(const PathArcs& arcs, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team);

}  // namespace superfacets
