// Stage 3: the first centers.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"
#include "clustering/islands.hpp"

namespace superfacets {

// A connected component is large if it has at least half of the expected measure of a region, or if
// all larger components together have fewer than n_seeds cells. The n_seeds largest of these
// components get seeds. Ties go to the component of `first`, then to the component with the lowest
// cell. All other components are islands. The direction of arcs does not matter for components.

// The cell nearest to the measure-weighted mean of all positions. Ties go to the lowest index.
Cell central_cell(const OrderedGraph& graph, ThreadTeam& team);

// The number of cells in components with at least half the expected measure of a region. If this
// number is at least n_seeds, all other components are islands.
std::int64_t n_cells_of_large_components(const OrderedGraph& graph, Cell n_seeds, ThreadTeam& team);

// Farthest-point sampling by Euclidean distance. Starts with `first`, and repeatedly adds the cell
// farthest from all chosen cells, until n_seeds <= N cells are chosen. Ties go to the lowest index.
// Time O(N log N + k log N) in practice, because a tree of bounding boxes skips groups of cells
// that are nearer to earlier seeds. Memory: 9 bytes per cell.
//
// If islands are not kept, islands get no seeds, and the other components start with the same seeds
// as in geodesic_seeds.
std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 Islands islands, ThreadTeam& team);

// Farthest-point sampling by path length. Starts with `first`, and repeatedly adds the cell with
// the longest path from its nearest chosen cell, until n_seeds <= N cells are chosen. Ties go to
// the lowest index.
//
// In a graph of several components, the first seeds are the cells nearest to the mean position of
// each large component (see update_centers), in the order of the components. Islands get no seed.
// If one-way arcs leave cells of large components unreached, the lowest unreached cell is the next
// seed.
//
// Time: about log k passes over a mesh, because each seed expands only to the cells for which it is
// the nearest seed. Memory: 12 bytes per cell, 28 if there are several components.
std::vector<Cell> geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team);

// Seeds along the curve for three fifths of n_seeds, then the cell with the longest path from all
// seeds, repeatedly, as in geodesic_seeds. The share of a cell is its measure times the root of the
// mean length of its arcs per straight distance, and each component is divided along the curve into
// parts of equal shares. A seed is the middle of a part. Large components get seeds in proportion
// to their shares, but at least one each; islands get none.
//
// Time: few passes, as gaps between seeds are small. Memory: as geodesic_seeds.
std::vector<Cell> curve_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                              ThreadTeam& team);

// Visits cells in ascending order of path length from `first`. Ties go to the lowest index. A
// visited cell that no region has reached starts a region. The region expands through the cells
// within `reach` of its first cell, and also labels the cells adjacent to them. The component of
// `first` is flooded first. The other components follow in the order of their lowest cells; each
// flood starts at the lowest cell. If islands are not kept, islands (for n_seeds expected regions)
// are left out. Cells that one-way arcs leave without a path from the start are visited last in
// their component.
std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, double reach,
                              Islands islands, ThreadTeam& team);

// Divides space into cubes of edge length `side`, with a corner at `corner`. The cells in each
// occupied cube form a region. Regions are in the order of their lowest cells. The seeds are the
// centers of these regions (see update_centers).
std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team);

}  // namespace superfacets
