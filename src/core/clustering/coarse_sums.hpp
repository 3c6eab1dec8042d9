// What coarse cells take over from the surface below them, summed over their cells.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/diffusion.hpp"
#include "clustering/coarsening.hpp"

namespace superfacets {

// Of arcs between coarse cells: the sum of conductance times step over all arcs of the surface that
// lead from one to the other. Symmetric, bit for bit. The surface has the cells of the fine graph,
// and each arc one back.
Buffer<double> crossing_conductances(const CoarseGraph& coarse, const CreaseConductance& formula,
                                     ThreadTeam& team);

// The sum of the vectors of the fine cells in each coarse cell.
Buffer<Point> coarse_sums(const CoarseGraph& coarse, std::span<const Point> vectors,
                          ThreadTeam& team);

}  // namespace superfacets
