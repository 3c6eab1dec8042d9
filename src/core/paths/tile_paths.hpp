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

// The best paths on a tile, from those known before (which no arc of the tile improves) and from
// what is proposed. The tile is the graph of its own cells, followed by its rim: cells of other
// tiles that its arcs lead to, and that have no arcs here. Where a path to the rim is better than
// before, it is to be proposed to the tile that owns the cell. When nothing is left to propose, no
// arc of any tile improves a path, so all have the best of all paths, as after one expansion on the
// whole graph, in whatever order tiles came.
TilePaths improve_paths(const OrderedGraph& tile, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team);

}  // namespace superfacets
