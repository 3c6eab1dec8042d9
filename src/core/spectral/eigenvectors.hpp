// The smoothest functions on a graph: eigenvectors of its Laplacian.
#pragma once

#include <cstddef>
#include <vector>

#include "cells/arcs.hpp"

namespace superfacets {

struct Eigenpairs {
  std::vector<double> values;   // (m,) ascending, > 0
  std::vector<double> vectors;  // (n, m) by cell; sum_i a_i x_i^2 = 1 for each
};

// The n_wanted smallest eigenvalues > 0 of L x = lambda A x, and their vectors; fewer where the
// graph has no more. L is the Laplacian of the conductances (> 0, the same both ways, one arc at
// most from each cell to each other), A the diagonal of the measures (> 0). The vectors that are
// constant on each component, of eigenvalue 0, are left out, however many there are; `components`
// has the number of each cell's, 0 to n_components - 1.
//
// Each vector has the sign that makes its entry of largest size positive, the first among equals.
// Of equal eigenvalues the vectors are some basis, always the same: the iteration begins with fixed
// vectors, and one thread runs it. Some 20 ms for 1,500 cells and 16 vectors.
Eigenpairs smallest_eigenpairs(const Arcs& arcs, std::span<const double> conductances,
                               std::span<const double> measures, std::span<const Label> components,
                               Label n_components, std::size_t n_wanted);

}  // namespace superfacets
