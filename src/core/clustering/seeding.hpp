// Stage 3: the first centers.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"
#include "clustering/islands.hpp"

namespace superfacets {

// A component of a graph is large if it has at least half of the measure expected of a region, or
// if all larger components together have fewer than n_seeds cells. The n_seeds largest of these get
// seeds; among equals the component of `first` precedes, then the one with the lowest cell. All
// other components are islands. Components ignore the direction of arcs.

// The cell nearest to the measure-weighted mean of all positions, lowest index among equals.
Cell central_cell(const OrderedGraph& graph, ThreadTeam& team);

// The number of cells in components with at least half of the measure expected of a region. The
// other components are islands, if this number is at least n_seeds.
std::int64_t n_cells_of_large_components(const OrderedGraph& graph, Cell n_seeds, ThreadTeam& team);

// `first`, then again and again the cell farthest (Euclidean) from all chosen cells, the lowest
// index among equals, until there are n_seeds <= N of them. Time O(N log N + k log N) in practice:
// a tree of bounding boxes skips groups of cells that are nearer to earlier seeds. Memory: 9 bytes
// per cell.
//
// If islands are not kept, they get no seeds, and the other components begin with the same cells as
// in geodesic_seeds.
std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 Islands islands, ThreadTeam& team);

// `first`, then again and again the cell with the longest path to the nearest cell chosen so far,
// lowest index among equals, until there are n_seeds <= N of them.
//
// In a graph of several components the first seeds are the cells nearest to the mean of each large
// component, as update_centers finds them, in the order of the components. Islands get no seed.
// Cells of large components that no seed reaches, because of the direction of arcs, count as
// farthest: the lowest of them is next.
//
// Time: each seed expands to the cells that it is nearest to; on meshes that takes about log k
// passes in total. Memory: 12 bytes per cell; 16 more if there are several components.
std::vector<Cell> geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team);

// Visits cells in the order of their path length from `first` (lowest index among equals). A
// visited cell that no region has reached starts a region, which expands through cells within
// `reach` of its position and labels the cells adjacent to these without expanding them. The
// component of `first` is flooded first, then the others in the order of their lowest cells, each
// from that cell. If islands are not kept, islands (for n_seeds expected regions) are left out.
// Cells without a path from the start, because of the direction of arcs, are visited last in their
// component.
std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, double reach,
                              Islands islands, ThreadTeam& team);

// Space is tiled from `corner` by cubes of edge `side`. Each occupied cube is a region, in the
// order of the lowest cells in them; the seeds are the centers of these regions, as an update finds
// them.
std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team);

}  // namespace superfacets
