// Stage 3: the first centers.
#pragma once

#include "types.hpp"

namespace superfacets {

// The cell nearest to a point; the lowest index among equals.
Cell nearest_cell(std::span<const Point> positions, Point target);

// `first`, then again and again the cell farthest (Euclidean) from all cells chosen so far, lowest
// index among equals, until there are n_seeds <= N of them. Time O(N log N + k log N) in practice:
// a tree of bounding boxes skips whole groups that a new center cannot bring nearer.
std::vector<Cell> farthest_seeds(std::span<const Point> positions, Cell first, Cell n_seeds);

// Visits cells in the order of their path length from `first` (lowest index among equals); a
// visited cell that no region has reached starts one, which expands through cells within `reach`
// of its position and labels, without expanding them, the cells around these. Components that
// `first` cannot reach are flooded one after the other, each from its lowest cell.
std::vector<Cell> flood_seeds(const CellGraph& graph, Cell first, double reach);

// Labels of the occupied cubes of edge `side` that tile space from `corner`, numbered by the lowest
// cell in each.
std::vector<Label> grid_labels(std::span<const Point> positions, Point corner, double side);

}  // namespace superfacets
