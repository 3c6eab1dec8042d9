// Shortest paths on a graph that is too large for memory, computed tile by tile.
#pragma once

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

// The arcs that leave the cells of a tile. Arcs lead to cells of the tile and to the rim. The rim
// consists of cells of other tiles, which are numbered after the cells of the tile, and have no
// arcs here.
struct PathArcs {
  std::span<const std::int64_t> offsets;  // (number of own cells + 1,)
  std::span<const Place> targets;
  std::span<const float> lengths;  // whole units >= 1
};

// Builds a graph with these arcs and without positions, for algorithms that use only arcs. n_cells
// counts the cells of the tile and its rim.
OrderedGraph graph_of_arcs(const PathArcs& input, std::size_t n_cells);

// Improves the paths to the cells of a tile and its rim. Input: the known paths, which no arc of
// the tile improves, and proposals. The caller must propose each improved path to a rim cell to the
// tile that owns the cell. When no proposals remain, no arc of any tile improves a path. The result
// then equals one expansion on the whole graph, for any order of tiles.
TilePaths improve_paths(const PathArcs& arcs, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team);

}  // namespace superfacets
