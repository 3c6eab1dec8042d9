// Shortest paths on a graph that is too large for memory, computed tile by tile.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Path to each place.
struct TilePaths {
  Buffer<PathLength> lengths;
  Buffer<Label> labels;
};

// Paths proposed to places of a tile.
struct PathProposals {
  std::span<const Place> places;
  std::span<const PathLength> lengths;
  std::span<const Label> labels;  // >= 0
};

// The arcs that leave the cells of a tile. They lead to cells of the tile and to its rim: cells of
// other tiles, numbered after the cells of the tile, which have no arcs here.
struct PathArcs {
  std::span<const std::int64_t> offsets;  // (number of own cells + 1,)
  std::span<const Place> targets;
  std::span<const float> lengths;  // whole units >= 1
};

// Builds a graph with these arcs and without positions, for algorithms that use arcs only. n_cells
// is the number of cells of the tile and its rim.
OrderedGraph graph_of_arcs(const PathArcs& input, std::size_t n_cells);

// Improves the paths to the cells of a tile and its rim, given the paths known before (which no arc
// of the tile improves) and proposals. If a path to the rim improves, it must be proposed to the
// tile that owns the cell. When there are no more proposals, no arc of any tile improves a path, so
// the result equals one expansion on the whole graph, in whatever order tiles were processed.
TilePaths improve_paths(const PathArcs& arcs, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team);

}  // namespace superfacets
