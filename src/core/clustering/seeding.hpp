// Stage 3: chooses the initial centers (seeds).
#pragma once

#include "clustering/islands.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Seeds are placed only in large connected components of the undirected graph. All other components
// are islands. To find the large components, components are sorted by descending measure. Among
// components with equal measures, the component of the cell `first` (see the functions below) comes
// first, and the others are sorted by their lowest cell. A component is large if its measure is at
// least half of (total measure / n_seeds), or if all components before it together have fewer than
// n_seeds cells. At most the first n_seeds components are large.

// The cell nearest to the measure-weighted mean of all positions, or the lowest cell if several are
// equally near.
Cell central_cell(const OrderedGraph& graph, ThreadTeam& team);

// The number of cells in components that have at least half the mean measure of a region. If this
// number is at least n_seeds, all other components are islands.
std::int64_t n_cells_of_large_components(const OrderedGraph& graph, Cell n_seeds, ThreadTeam& team);

// Farthest-point sampling with Euclidean distances. Starts with `first`, and repeatedly adds the
// cell farthest from all chosen cells (the lowest cell, if several are equally far), until n_seeds
// <= N cells are chosen. Time O(N log N + k log N) in practice, because a tree of bounding boxes
// skips groups of cells that are nearer to earlier seeds. Uses 9 bytes per cell.
//
// If `islands` is not kKeep, islands get no seeds, and the first seeds of the large components are
// the same as in geodesic_seeds.
std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 Islands islands, ThreadTeam& team);

// Seeds, and the paths from the seeds, as computed by Classification.
using SeedsAndPaths = std::pair<std::vector<Cell>, PathArrays>;

// Farthest-point sampling with path lengths. Starts with `first`, and repeatedly adds the cell with
// the longest path from its nearest chosen cell (the lowest cell, if several paths are equally
// long), until n_seeds <= N cells are chosen.
//
// If the graph has several components, the first seeds are the cells nearest to the mean position
// of each large component (see update_centers), from the largest component to the smallest. Islands
// get no seeds. If one-way arcs leave cells of large components unreached, the lowest unreached
// cell is the next seed.
//
// The time is about log k passes over the mesh for k seeds, because each seed expands only to the
// cells for which it is the nearest seed. Uses 12 bytes per cell, or 28 if there are several
// components.
SeedsAndPaths geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, ThreadTeam& team);

// Chooses the first 60% of the seeds along the space-filling curve, and the remaining seeds as in
// geodesic_seeds. Along the curve, each component is divided into parts of equal weight, and the
// middle cell of each part is a seed. The weight of a cell is its measure times sqrt(sum of its arc
// lengths / sum of the straight distances of these arcs), so that seeds are denser near creases.
// Large components get seeds in proportion to their total weight, but at least one each. Islands
// get no seeds.
//
// The time is a few passes over the mesh, because gaps between seeds are small. Uses as much memory
// as geodesic_seeds.
SeedsAndPaths curve_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, ThreadTeam& team);

// Visits cells in ascending order of path length from `first`, then of index. If no region has
// reached the visited cell, it becomes the seed of a new region. The region expands through all
// cells within the Euclidean distance `reach` of the seed, and also reaches the neighbors of these
// cells. The component of `first` is flooded first. The other components follow in the order of
// their lowest cells; each flood starts at the lowest cell. If `islands` is not kKeep, islands get
// no seeds; n_seeds is then the expected number of regions. If one-way arcs leave cells without a
// path from the start, these cells are visited last in their component.
std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, double reach,
                              Islands islands, ThreadTeam& team);

// Divides space into cubes of edge length `side`, with a corner at `corner`. The cells in each
// occupied cube form a region. Regions are sorted by their lowest cell index. The seeds are the
// centers of these regions (see update_centers).
std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team);

}  // namespace superfacets
