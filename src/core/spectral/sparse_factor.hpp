// Factorization of a sparse symmetric matrix, to solve many systems of equations with it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// M = P^T F D F^T P for a symmetric, positive definite matrix M whose off-diagonal entries are on
// the arcs of a graph. The graph has some thousand cells, and at most one arc from each cell to
// another. Cells are eliminated by minimum degree, the lowest index first among equals. On graphs
// of surfaces the factors have about n log n entries.
class SparseFactor {
 public:
  // M has `diagonal` on its diagonal, and minus the conductance of each arc as other entries. Arcs
  // have reverse arcs of the same conductance.
  SparseFactor(const Arcs& arcs, std::span<const double> conductances,
               std::span<const double> diagonal);

  // Solves M X = B in place: `rows` holds B, then X, as n rows of `width` numbers.
  void solve(std::span<double> rows, std::size_t width) const;

 private:
  struct Entry {
    Cell cell;
    double value;
  };
  using Row = std::vector<Entry>;  // sorted by cell

  struct Elimination {
    Cell cell;
    Cell neighbor;  // the row of this cell is updated
  };
  static void subtract(const Row& pivot_row, double factor, const Elimination& step, Row& row,
                       Row& merged);

  std::vector<Cell> order_;             // cells in their order of elimination
  std::vector<double> pivots_;          // diagonal of D, in this order
  std::vector<std::size_t> starts_{0};  // start of the entries of each column, in this order
  std::vector<Entry> entries_;          // entries of the columns of F, without its diagonal of ones
};

}  // namespace superfacets
