// Shortest paths on a graph that is too large for memory, computed tile by tile.
#pragma once

#include "paths/expansion.hpp"

namespace superfacets {

// Length and label of the path to each cell.
struct TilePaths {
  Buffer<PathLength> lengths;  // (N,) path length of each cell; kUnreached if there is no path
  Buffer<Label> labels;        // (N,) label of each cell; kNoLabel if there is no path
};

// Paths to cells of a tile that were found in other tiles.
struct PathProposals {
  std::span<const Place> places;        // target cell of each path
  std::span<const PathLength> lengths;  // length of each path
  std::span<const Label> labels;        // label of each path, >= 0
};

// The arcs that leave the cells of a tile. Arcs lead to cells of the tile and to the rim. The rim
// consists of cells of other tiles, which are numbered after the cells of the tile, and have no
// arcs here.
struct PathArcs {
  std::span<const std::int64_t> offsets;  // (cells of the tile + 1,) start of each cell's arcs
  std::span<const Place> targets;         // (M,) target cell of each arc
  std::span<const float> lengths;         // (M,) length of each arc, a whole number >= 1
};

// Builds a graph with the given arcs and without positions, for algorithms that use only arcs.
// n_cells is the number of cells of the tile and its rim.
OrderedGraph graph_of_arcs(const PathArcs& input, std::size_t n_cells);

// Improves the paths to the cells of a tile and its rim. The input consists of the current paths,
// which no arc of the tile improves, and of proposals. The caller must pass each improved path to a
// rim cell, as a proposal, to the tile that contains the cell. When no proposals remain, no arc of
// any tile improves a path. The result then equals an expansion on the whole graph, for any order
// of tiles.
TilePaths improve_paths(const PathArcs& arcs, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team);

}  // namespace superfacets
