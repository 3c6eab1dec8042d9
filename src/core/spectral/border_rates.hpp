// How likely people are to draw borders between the parts of a shape, estimated from three
// features.
#pragma once

#include "cells/part_costs.hpp"
#include "spectral/diffusion.hpp"

namespace superfacets {

// The expected number of borders that people draw across each arc: the rate of borders times the
// length of the arc. Arcs, widths and rows are in the order of the input; `widths` are as in
// Smoother. `normals` has a unit normal, or the mean normal of a group, per cell; 0 if unknown.
// `vectors` is the spectral embedding.
//
// The rate is a logistic function of a polynomial of degree 2 of three features. `coefficients`
// contains coefficients of features, of their products 11, 12, 13, 22, 23, 33, and a constant.
// Features:
// - the bend along the arc: the turn of the smoothed normals per length, negative if concave,
// - the change of the embedding along the arc, relative to the mean change nearby,
// - the mean of concave bends nearby.
// Features do not change with the scale of the shape and hardly with its resolution. Normals are
// smoothed over 1 %, the embedding over 2 %, and means over 4 % of the square root of the area. An
// arc and its reverse arc get the same value.
Buffer<float> border_rates(const OrderedGraph& graph, const Arcs& arcs,
                           std::span<const double> widths, const CellRows& normals,
                           const CellRows& vectors, std::span<const double> coefficients,
                           ThreadTeam& team);

}  // namespace superfacets
