// Builds the coarse cells of one tile of a graph that is too large for memory.
#pragma once

#include "cells/ordered_graph.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// The coarse cells of the first n_own places of a graph, numbered from 0.
struct TileCells {
  std::vector<Place> centers;
  Buffer<Point> positions;
  Buffer<double> measures;
  Buffer<Cell> of;        // (n_own,) the coarse cell of each place
  Buffer<float> lengths;  // (n_own,) length of the path from the center of this cell
};

// Divides a tile into coarse cells. The graph of a tile has n_own consecutive cells of the curve,
// followed by the rim (see PathArcs). A tile consists of whole ranges of places, so the result
// equals the cells of CoarseGraph on the whole graph.
TileCells divide_tile(const OrderedGraph& tile, Place n_own, Place cell_size, ThreadTeam& team);

struct TileArcs {
  std::vector<std::int64_t> offsets;  // (number of coarse cells of the tile + 1,)
  std::vector<Arc> arcs;              // sorted by target
};

// Returns the arcs of the coarse cells of a tile. For each place of the tile and of its rim,
// `coarse` holds the index of its coarse cell in the whole graph, and `lengths` holds the length of
// the path from the center of that cell (see CrossingLengths). If steps are straight, `positions`
// holds the positions of the coarse cells.
TileArcs connect_tile(const OrderedGraph& tile, Place n_own, std::span<const Cell> coarse,
                      std::span<const float> lengths, std::span<const Point> positions,
                      ThreadTeam& team);

// For each region, the cell nearest to the target of the region, and its squared distance. Ties go
// to the lowest cell. A region without a cell in the tile has kNoCell and infinity.
struct NearestOfRegions {
  std::vector<double> squared_distances;
  std::vector<Cell> cells;
};

// Time O(n). Cells may be in any order. A cell with kNoLabel is in no region.
NearestOfRegions nearest_of_regions(std::span<const Point> positions, std::span<const Cell> cells,
                                    std::span<const Label> labels, std::span<const Point> targets);

}  // namespace superfacets
