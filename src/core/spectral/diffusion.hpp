// Diffusion on a graph whose arcs have conductances.
#pragma once

#include "cells/ordered_graph.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Minimum conductance of an arc. A positive minimum connects all parts of the surface.
inline constexpr double kLeastConductance = 1e-6;

// Conductance of each arc, (M,): sqrt(A_i + A_j) / g + kLeastConductance. A is the area of a cell,
// and g is the length of the step (eq. 1 of the paper). The square root approximates the length of
// the edge. The angle between cells has no influence. An arc and its reverse arc have the same
// bits.
Buffer<double> step_conductances(const Surface& surface, std::span<const double> areas,
                                 ThreadTeam& team);

// The arcs of a graph with straight steps, by cell and without padding.
struct ConductingArcs {
  Buffer<std::int64_t> offsets;  // (N + 1,)
  Buffer<Cell> neighbors;        // (M,)
  Buffer<double> steps;          // (M,) see straight_step
  Buffer<double> conductances;   // (M,) sqrt(A_i + A_j) / step exp(-steepness kappa), at least
                                 // kLeastConductance
  double hindered_share = 0.0;   // creases reduce the sum of sqrt(A_i + A_j) to this fraction
};

// Computes conducting arcs. crease_unit is the price of a concave turn by pi, and kappa is the
// price of an arc divided by crease_unit. kappa is 0 if crease_unit is 0.
ConductingArcs conducting_arcs(const OrderedGraph& graph, double crease_unit, double steepness,
                               ThreadTeam& team);

// The distance between the positions of the two cells of an arc. Two cells may share a position, so
// the result is at least a small fraction of their border width, and never 0.
double straight_step(const OrderedGraph& graph, Place from, const Arc& arc);

// The straight_step of each arc of a graph in which each place equals its cell.
Buffer<double> straight_steps(const OrderedGraph& graph, ThreadTeam& team);

// For each arc between two coarse cells, sums conductance times step length over all fine arcs from
// the first coarse cell to the second. `coarse_of` holds the coarse cell of each fine cell. The
// targets of the arcs of a coarse cell are ascending.
Buffer<double> sum_between(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> steps, std::span<const Cell> coarse_of,
                           const Arcs& coarse);

// Repeatedly replaces each row of `width` numbers by 1/4 of the row plus 3/4 of the mean of the
// neighbors' rows, weighted by conductance. Rows of cells without arcs do not change.
void relax(const Arcs& arcs, std::span<const double> conductances, std::size_t width, int n_sweeps,
           ThreadTeam& team, std::span<float> rows);

// Solves (M + T L) x = M v by conjugate gradients. M is diagonal with the masses, L is the
// Laplacian of the conductances, and T is `time`. If masses are areas, this smooths v over a length
// sqrt(T). Cells of mass 0 are interpolated from their neighbors. In connected components without
// mass, the result is 0.
std::vector<double> diffuse(const Arcs& arcs, std::span<const double> conductances,
                            std::span<const double> masses, std::span<const double> values,
                            double time, ThreadTeam& team);

}  // namespace superfacets
