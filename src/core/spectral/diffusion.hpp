// Diffusion along arcs with conductances: conductances of fine and coarse arcs, relaxation of rows
// of numbers, and smoothing.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Smallest conductance of an arc, so that no part of the surface is cut off.
inline constexpr double kLeastConductance = 1e-6;

struct ConductanceOptions {
  double diagonal = 1.0;     // d, the divisor of the weights
  double crease_unit = 1.0;  // length that a concave turn by pi adds to an arc
  double steepness = 20.0;   // rate at which conductance decreases with kappa
};

struct Conductances {
  Buffer<double> steps;  // (M,) step lengths g, eq. 1 of the paper
  Buffer<double>
      conductances;  // (M,) sqrt(A_i + A_j) / g exp(-steepness kappa) + kLeastConductance
};

// Computes the step length g and the conductance of an arc. kappa is measured by the weight of the
// arc: w = (g + crease_unit kappa) / d. It is 0 without weights, or if crease_unit is 0. The square
// root, in the conductance, approximates the length of the edge. An arc and its reverse arc have
// the same bits.
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

// Computes the step lengths and conductances of all arcs.
Conductances crease_conductances(const CreaseConductance& formula, ThreadTeam& team);

// Returns the given conductances times exp(-steepness |v_i - v_j|) plus kLeastConductance, where
// v_i is the value of cell i.
Buffer<double> hindered_conductances(const Arcs& arcs, std::span<const double> conductances,
                                     std::span<const double> values, double steepness,
                                     ThreadTeam& team);

// Sums conductance times step length, for each arc between two coarse cells, over all fine arcs
// from the one to the other. `coarse_of` holds the coarse cell of each cell; the targets of coarse
// arcs are ascending.
Buffer<double> sum_between(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> steps, std::span<const Cell> coarse_of,
                           const Arcs& coarse);

// Repeatedly replaces each row of `width` numbers by a mean: 1/4 of the row itself and 3/4 of the
// rows of its neighbors, weighted by conductances. Rows of cells without arcs stay as they are.
void relax(const Arcs& arcs, std::span<const double> conductances, std::size_t width, int n_sweeps,
           ThreadTeam& team, std::span<float> rows);

// Solves (M + T L) x = M v by conjugate gradients. M is diagonal with the masses, L is the
// Laplacian of the conductances, and T is `time`. If masses are areas, this smooths v over a length
// sqrt(T). Cells of mass 0 are interpolated from their neighbors; in components without mass the
// result is 0.
std::vector<double> diffuse(const Arcs& arcs, std::span<const double> conductances,
                            std::span<const double> masses, std::span<const double> values,
                            double time, ThreadTeam& team);

}  // namespace superfacets
