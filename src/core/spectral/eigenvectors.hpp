// Eigenvectors of the Laplacian of a graph, which are the smoothest functions on the graph.
#pragma once

#include <cstddef>

#include "cells/arcs.hpp"

namespace superfacets {

struct Eigenpairs {
  std::vector<double> values;   // (m,) ascending, > 0
  std::vector<double> vectors;  // (n, m) a row per cell; sum_i a_i x_i^2 = 1 for each column x
};

// The n_wanted smallest eigenvalues > 0 of L x = lambda A x, and their vectors; fewer if the graph
// has no more. L is the Laplacian of the conductances (> 0, symmetric, at most one arc from each
// cell to another). A is the diagonal matrix of the measures (> 0). All vectors of eigenvalue 0 are
// left out: they are constant on each connected component. `components` holds the component of each
// cell, 0 to n_components - 1.
//
// The sign of a vector makes its entry of largest magnitude positive; ties go to the first entry.
// Equal eigenvalues get an arbitrary but always equal basis, because the iteration begins with
// fixed vectors and runs on one thread. Takes about 20 ms for 1,500 cells and 16 vectors.
Eigenpairs smallest_eigenpairs(const Arcs& arcs, std::span<const double> conductances,
                               std::span<const double> measures, std::span<const Label> components,
                               Label n_components, std::size_t n_wanted);

}  // namespace superfacets
