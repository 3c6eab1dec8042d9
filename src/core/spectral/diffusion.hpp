// Functions on cells that spread along conducting arcs: how well arcs conduct, from fine cells to
// coarse ones and back, and smoothing.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// What every arc keeps, so that no part of the surface is cut off.
inline constexpr double kLeastConductance = 1e-6;

struct ConductanceOptions {
  double diagonal = 1.0;     // d, the unit of the weights
  double crease_unit = 1.0;  // what a turn by pi at a concave edge adds to a weight, in lengths
  double steepness = 20.0;   // of the price of creases
};

struct Conductances {
  Buffer<double> steps;  // (M,) g of eq. 1
  Buffer<double>
      conductances;  // (M,) sqrt(A_i + A_j) / g exp(-steepness kappa), and kLeastConductance
};

// How well an arc conducts, and the length of its step. Creases make arcs longer,
// w = (g + crease_unit kappa) / d; without weights, and with a unit of 0, kappa is 0. The square
// root stands for the length of the edge. Symmetric, bit for bit.
struct CreaseConductance {
  const Surface& surface;
  std::span<const double> areas;    // (N,)
  std::span<const double> weights;  // (M,) or empty
  ConductanceOptions options;

  struct Found {
    double step;
    double conductance;
  };
  Found of(Cell cell, const Step& arc) const;
};

// Of all arcs.
Conductances crease_conductances(const CreaseConductance& formula, ThreadTeam& team);

// The same with exp(-steepness |v_i - v_j|) as a factor, for a number of each cell, and
// kLeastConductance added.
Buffer<double> hindered_conductances(const Arcs& arcs, std::span<const double> conductances,
                                     std::span<const double> values, double steepness,
                                     ThreadTeam& team);

// Of arcs between coarse cells: the sum of conductance times step over the arcs that lead from one
// to the other. `coarse_of` has the coarse cell of each; targets of coarse cells are ascending.
Buffer<double> sum_between(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> steps, std::span<const Cell> coarse_of,
                           const Arcs& coarse);

// Replaces each row of `width` numbers by its mean with that of its neighbors, weighted by
// conductances, several times.
void relax(const Arcs& arcs, std::span<const double> conductances, std::size_t width, int n_sweeps,
           ThreadTeam& team, std::span<float> rows);

// Solves (M + T L) x = M v by conjugate gradients: v, smoothed over a length sqrt(T) where masses
// are areas. Cells of mass 0 take what their neighbors have; components of such cells, 0.
std::vector<double> diffuse(const Arcs& arcs, std::span<const double> conductances,
                            std::span<const double> masses, std::span<const double> values,
                            double time, ThreadTeam& team);

}  // namespace superfacets
