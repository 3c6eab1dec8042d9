// Diffusion along arcs with conductances: conductances of fine and coarse arcs, interpolation
// between levels, and smoothing.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Smallest conductance, so that no part of the surface is cut off.
inline constexpr double kLeastConductance = 1e-6;

struct ConductanceOptions {
  double diagonal = 1.0;     // d, the unit of the weights
  double crease_unit = 1.0;  // length that a concave turn by pi adds to an arc
  double steepness = 20.0;   // rate at which conductance decreases with kappa
};

struct Conductances {
  Buffer<double> steps;  // (M,) g of eq. 1
  Buffer<double>
      conductances;  // (M,) sqrt(A_i + A_j) / g exp(-steepness kappa) + kLeastConductance
};

// The conductance of an arc, and the length of its step. Weights are w = (g + crease_unit kappa) /
// d, which gives kappa; without weights, or with a unit of 0, kappa is 0. The square root stands
// for the length of the edge. Symmetric, bit for bit.
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

// The same conductances times exp(-steepness |v_i - v_j|), with a number v per cell, plus
// kLeastConductance.
Buffer<double> hindered_conductances(const Arcs& arcs, std::span<const double> conductances,
                                     std::span<const double> values, double steepness,
                                     ThreadTeam& team);

// For arcs between coarse cells: the sum of conductance times step over all fine arcs from one to
// the other. `coarse_of` holds the coarse cell of each cell; targets of coarse arcs are ascending.
Buffer<double> sum_between(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> steps, std::span<const Cell> coarse_of,
                           const Arcs& coarse);

// Repeatedly replaces each row of `width` numbers by a mean of itself and its neighbors, weighted
// by conductances.
void relax(const Arcs& arcs, std::span<const double> conductances, std::size_t width, int n_sweeps,
           ThreadTeam& team, std::span<float> rows);

// Solves (M + T L) x = M v by conjugate gradients: smooths v over a length sqrt(T) if masses are
// areas. Cells of mass 0 are interpolated from their neighbors; 0 in components without mass.
std::vector<double> diffuse(const Arcs& arcs, std::span<const double> conductances,
                            std::span<const double> masses, std::span<const double> values,
                            double time, ThreadTeam& team);

}  // namespace superfacets
