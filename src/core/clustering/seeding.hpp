// Stage 3: the first centers.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// The cell nearest to the measure-weighted mean of all positions, lowest index among equals.
Cell central_cell(const OrderedGraph& graph, ThreadTeam& team);

// `first`, then again and again the cell farthest (Euclidean) from all cells chosen so far, lowest
// index among equals, until there are n_seeds <= N of them. Time O(N log N + k log N) in practice:
// a tree of bounding boxes skips whole groups that a new center cannot bring nearer. Memory: 9
// bytes a cell.
std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team);

// `first`, then again and again the cell with the longest path to the nearest cell chosen so far,
// lowest index among equals, until there are n_seeds <= N of them.
//
// A graph of several components begins with the cell nearest to the mean of each, as
// update_centers finds it, in the order of falling measures (then of lowest cells), as long as they
// have half of the measure expected of a region, or all before have fewer cells than seeds are
// wanted; n_seeds components at most. The others get no seed. (Where arcs lead one way, a component
// is what can be reached, as classify finds it.)
//
// Time: each seed expands to where paths from it are the shortest; on meshes that adds up to some
// log k passes. Memory: 12 bytes a cell; 16 more where there are several components.
std::vector<Cell> geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team);

// Visits cells in the order of their path length from `first` (lowest index among equals); a
// visited cell that no region has reached starts one, which expands through cells within `reach`
// of its position and labels, without expanding them, the cells around these. Components that
// `first` cannot reach are flooded one after the other, each from its lowest cell. Arcs are taken
// to lead both ways.
std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, double reach,
                              ThreadTeam& team);

// The centers, by an update, of the regions that the occupied cubes of edge `side` make which tile
// space from `corner`; the order is that of the lowest cell in each.
std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team);

}  // namespace superfacets
