// The smoothest functions on a graph: eigenvectors of its Laplacian.
#pragma once

#include <cstddef>
#include <vector>

#include "cells/arcs.hpp"

namespace superfacets {

struct Eigenpairs {
  std::vector<double> values;   // (m,) ascending, > 0
  std::vector<double> vectors;  // (n, m) a row per cell; sum_i a_i x_i^2 = 1 for each column x
};

// The n_wanted smallest eigenvalues > 0 of L x = lambda A x, and their vectors; fewer if the graph
// has no more. L is the Laplacian of the conductances (> 0, symmetric, at most one arc from each
// cell to another). A is the diagonal matrix of the measures (> 0). Vectors of eigenvalue 0, which
// are constant on each connected component, are left out, however many there are; `components`
// holds the component of each cell, 0 to n_components - 1.
//
// The sign of each vector makes its entry of largest size positive, the first among equals. For
// equal eigenvalues the basis is arbitrary, but always the same: the iteration begins with fixed
// vectors and runs on one thread. About 20 ms for 1,500 cells and 16 vectors.
Eigenpairs smallest_eigenpairs(const Arcs& arcs, std::span<const double> conductances,
                               std::span<const double> measures, std::span<const Label> components,
                               Label n_components, std::size_t n_wanted);

}  // namespace superfacets
