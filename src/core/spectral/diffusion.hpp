// Diffusion on a graph whose arcs have conductances.
#pragma once

#include "cells/ordered_graph.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Minimum conductance of an arc. The minimum is positive, so that creases never disconnect the
// surface.
inline constexpr double kMinConductance = 1e-6;

// The arcs of a graph in the order of the input, without padding.
struct ConductingArcs {
  Buffer<std::int64_t> offsets;   // (N + 1,) start of each cell in `neighbors`
  Buffer<Cell> neighbors;         // (M,) target cell of each arc
  Buffer<double> steps;           // (M,) length of each arc; see straight_step
  Buffer<double> conductances;    // (M,) conductance of each arc
  double blocked_fraction = 0.0;  // fraction of the total border width that is blocked by creases
};

// Computes the conductance of each arc: sqrt(A_i + A_j) / step * exp(-steepness * kappa) +
// kMinConductance. A is the area of a cell, so the square root approximates the width of the
// border. kappa is the crease cost of the arc divided by crease_unit, the crease cost of a concave
// edge with the angle pi. If crease_unit is 0, kappa is 0. The graph must have a straight_unit > 0
// (see OrderedGraph).
ConductingArcs conducting_arcs(const OrderedGraph& graph, double crease_unit, double steepness,
                               ThreadTeam& team);

// The distance between the positions of the two cells of an arc. It is at least a fraction of the
// width of their border, so it is never 0, even if both cells have the same position.
double straight_step(const OrderedGraph& graph, Place from, const Arc& arc);

// The straight_step of each arc of a graph whose cells are sorted in the order of the input. The
// arcs must not be stored in rows.
Buffer<double> straight_steps(const OrderedGraph& graph, ThreadTeam& team);

// For each arc between two coarse cells, sums (conductance times step length) over all fine arcs
// from the first coarse cell to the second. `coarse_of` contains the coarse cell of each fine cell.
// The targets of the arcs of a coarse cell must be ascending.
Buffer<double> sum_between(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> steps, std::span<const Cell> coarse_of,
                           const Arcs& coarse);

// Rows of numbers, one row per cell.
struct CellRows {
  std::size_t width;            // numbers per row
  std::span<const float> rows;  // (N, width)
};

// Returns the smoothed rows. Each sweep replaces a row by 1/4 of the row plus 3/4 of the mean of
// the neighbors' rows, weighted by conductance. Rows of cells without arcs do not change.
Buffer<float> relax(const Arcs& arcs, std::span<const double> conductances, const CellRows& given,
                    int n_sweeps, ThreadTeam& team);

// Smooths rows of numbers over a given length, by an implicit step of the heat equation.
class Smoother {
 public:
  // `arcs` are arcs between the cells of the graph in the order of the input, and `widths` the
  // lengths of the borders that they cross. If `widths` is empty, they are estimated from areas.
  Smoother(const OrderedGraph& graph, const Arcs& arcs, std::span<const double> widths,
           ThreadTeam& team);

  // Returns the solution x of (A + length^2 L) x = A rows after at most 20 Jacobi sweeps, where A
  // are areas, and L is the Laplacian with the conductances width / step.
  Buffer<float> smoothed(const CellRows& given, double length, ThreadTeam& team) const;

  double width(std::int64_t arc) const { return widths_[arc]; }
  double step(std::int64_t arc) const { return steps_[arc]; }
  Point position(Cell cell) const { return graph_.positions[graph_.place_of(cell)]; }

 private:
  double area(Cell cell) const { return graph_.measures[graph_.place_of(cell)]; }

  const OrderedGraph& graph_;
  const Arcs& arcs_;
  Buffer<double> widths_;  // (M,) length of the border that each arc crosses
  Buffer<double> steps_;   // (M,) length of each arc
  double total_ = 0.0;     // sum of all conductances
};

}  // namespace superfacets
