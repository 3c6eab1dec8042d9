// Stage 3: the first centers.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"
#include "clustering/islands.hpp"

namespace superfacets {

// A component is large enough for seeds of its own if it has half of the measure expected of a
// region, or all that are larger have fewer cells than seeds are wanted; n_seeds components at
// most, the largest first, among equals that of the first cell, then that with the lowest cell. The
// others are islands. (Arcs that lead one way connect as all others do.)

// The cell nearest to the measure-weighted mean of all positions, lowest index among equals.
Cell central_cell(const OrderedGraph& graph, ThreadTeam& team);

// `first`, then again and again the cell farthest (Euclidean) from all cells chosen so far, lowest
// index among equals, until there are n_seeds <= N of them. Time O(N log N + k log N) in practice:
// a tree of bounding boxes skips whole groups that a new center cannot bring nearer. Memory: 9
// bytes a cell.
//
// Where islands are not kept, they get no seeds, and the other components begin with the cells
// that geodesic_seeds begins with.
std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 Islands islands, ThreadTeam& team);

// `first`, then again and again the cell with the longest path to the nearest cell chosen so far,
// lowest index among equals, until there are n_seeds <= N of them.
//
// A graph of several components begins with the cell nearest to the mean of each that is large
// enough, as update_centers finds it, in their order. Islands get no seed. Cells of the others that
// no seed reaches, against the direction of arcs, are farther than all: the lowest is next.
//
// Time: each seed expands to where paths from it are the shortest; on meshes that adds up to some
// log k passes. Memory: 12 bytes a cell; 16 more where there are several components.
std::vector<Cell> geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team);

// Visits cells in the order of their path length from `first` (lowest index among equals); a
// visited cell that no region has reached starts one, which expands through cells within `reach`
// of its position and labels, without expanding them, the cells around these. The component of
// `first` is flooded first, then the others in the order of their lowest cells, each from there;
// but for islands among n_seeds regions, where they are not kept. Cells that no path from there
// leads to, against the direction of arcs, are visited after all others of their component.
std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, double reach,
                              Islands islands, ThreadTeam& team);

// The centers, by an update, of the regions that the occupied cubes of edge `side` make which tile
// space from `corner`; the order is that of the lowest cell in each.
std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team);

}  // namespace superfacets
