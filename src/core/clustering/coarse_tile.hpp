// Builds the coarse cells of one tile of a graph that is too large for memory.
#pragma once

#include "cells/ordered_graph.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// The coarse cells of a tile, numbered from 0. The tile consists of the first n_own cells of a
// graph.
struct TileCells {
  std::vector<Place> centers;  // fine cell at the center of each coarse cell
  Buffer<Point> positions;     // mean position of each coarse cell
  Buffer<double> measures;     // area or volume of each coarse cell
  Buffer<Cell> of;             // (n_own,) coarse cell of each fine cell
  Buffer<float> lengths;       // (n_own,) `length` of each fine cell, as defined at divide_range
};

// Divides a tile into coarse cells. The graph of a tile has n_own consecutive cells of the
// space-filling curve, followed by the rim: adjacent cells of other tiles (see PathArcs). A tile
// consists of whole ranges (see CoarseGraph), so the result equals the coarse cells of CoarseGraph
// on the whole graph.
TileCells divide_tile(const OrderedGraph& tile, Place n_own, Place cell_size, ThreadTeam& team);

struct TileArcs {
  std::vector<std::int64_t> offsets;  // (coarse cells + 1,) start of each coarse cell in `arcs`
  std::vector<Arc> arcs;              // arcs of each coarse cell, sorted by target
};

// Returns the arcs of the coarse cells of a tile. For each fine cell of the tile and of its rim,
// `coarse` contains the index of its coarse cell in the whole graph, and `lengths` contains its
// `length` from divide_range. If the graph has a straight_unit > 0 (see OrderedGraph), `positions`
// contains the positions of the coarse cells.
TileArcs connect_tile(const OrderedGraph& tile, Place n_own, std::span<const Cell> coarse,
                      std::span<const float> lengths, std::span<const Point> positions,
                      ThreadTeam& team);

// For each region, the cell nearest to the target point of the region, and its squared distance. If
// a region has no cell in the tile, the cell is kNoCell and the distance is infinite.
struct NearestOfRegions {
  std::vector<double> squared_distances;
  std::vector<Cell> cells;
};

// Finds the cell of each region that is nearest to targets[region]; the lowest cell if several are
// equally near. Cells may be in any order. A cell with kNoLabel is in no region. Time O(n).
NearestOfRegions nearest_of_regions(std::span<const Point> positions, std::span<const Cell> cells,
                                    std::span<const Label> labels, std::span<const Point> targets);

}  // namespace superfacets
