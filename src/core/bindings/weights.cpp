// Bindings of stage 2: weights of arcs, and colors of textures. The functions are documented in the
// headers of cells/. Their preconditions are checked by superfacets/_validate.py.

#include "bindings/bindings.hpp"
#include "cells/part_prices.hpp"
#include "cells/point_surface.hpp"
#include "cells/quantization.hpp"
#include "cells/surface_weights.hpp"
#include "cells/texels.hpp"

namespace superfacets {
namespace {

auto weights_of_triangles(const TriangleSurface& surface, Points centroids, Doubles areas,
                          Points normals, const EdgeFactors& factors, bool wants_turn,
                          Bytes is_counted, ThreadTeam& team) {
  Buffer<double> weights(surface.arcs().n_arcs());
  const NetTurn net_turn(factors.diagonal, is_counted);
  const EdgeSums sums = triangle_weights(surface, {centroids, areas, normals}, factors,
                                         wants_turn ? &net_turn : nullptr, team, weights.span());
  return std::tuple(std::move(weights), sums);
}

auto weights_of_surface(const Surface& surface, const EdgeFactors& factors, bool wants_turn,
                        Bytes is_counted, ThreadTeam& team) {
  Buffer<double> weights(surface.arcs().n_arcs());
  const NetTurn net_turn(factors.diagonal, is_counted);
  const EdgeSums sums =
      surface_weights(surface, factors, wants_turn ? &net_turn : nullptr, team, weights.span());
  return std::tuple(std::move(weights), sums);
}

Buffer<double> weights_of_points(const PointSurface& surface, const EdgeFactors& factors,
                                 ThreadTeam& team) {
  Buffer<double> weights(surface.arcs().n_arcs());
  point_weights(surface, factors, team, weights.span());
  return weights;
}

Buffer<double> stk02_of_triangles(const TriangleSurface& surface, Points centroids, double alpha,
                                  ThreadTeam& team) {
  Buffer<double> weights(surface.arcs().n_arcs());
  stk02_weights(surface, centroids, alpha, team, weights.span());
  return weights;
}

Buffer<double> stk02_of_polygons(const PolygonSurface& surface, double alpha, ThreadTeam& team) {
  Buffer<double> weights(surface.arcs().n_arcs());
  stk02_weights(surface, alpha, team, weights.span());
  return weights;
}

Buffer<float> with_part_prices(Offsets offsets, Integers neighbors, Floats lengths,
                               Integers group_of, const Table<float>& vectors, double factor,
                               ThreadTeam& team) {
  const PartVectors psi{vectors.shape(1), {vectors.data(), vectors.size()}, group_of};
  return add_part_prices({offsets, neighbors}, lengths, psi, factor, team);
}

Buffer<double> with_feature_steps(Offsets offsets, Integers neighbors, Doubles weights,
                                  const Table<double>& features, double factor, ThreadTeam& team) {
  return add_feature_steps({offsets, neighbors}, weights, {features.data(), features.size()},
                           features.shape(1), factor, team);
}

auto quantized(Doubles weights, ThreadTeam& team) {
  Buffer<float> lengths(weights.size());
  const double unit = quantize_weights(weights, team, lengths.span());
  return std::tuple(std::move(lengths), unit);
}

Buffer<float> rounded(Doubles weights, double unit, ThreadTeam& team) {
  Buffer<float> lengths(weights.size());
  round_weights(weights, unit, team, lengths.span());
  return lengths;
}

TexelGrid grid_of(std::int64_t width, std::int64_t height, int wrap_u, int wrap_v) {
  return {width, height, static_cast<Wrap>(wrap_u), static_cast<Wrap>(wrap_v)};
}

TexelColors colors_of_texels(Bytes pixels, std::int64_t width, std::int64_t height, int wrap_u,
                             int wrap_v, Integers linear, Doubles coordinates, Integers corners,
                             ThreadTeam& team) {
  const TexelGrid grid = grid_of(width, height, wrap_u, wrap_v);
  return texel_colors(pixels, grid, linear, {coordinates, corners}, team);
}

Buffer<std::int32_t> painted_ids(std::int64_t width, std::int64_t height, int wrap_u, int wrap_v,
                                 Doubles coordinates, Integers corners, Integers ids, int bleed,
                                 ThreadTeam& team) {
  const TexelGrid grid = grid_of(width, height, wrap_u, wrap_v);
  return paint_ids(grid, {coordinates, corners}, ids, bleed, team);
}

}  // namespace

void bind_weights(nb::module_& module) {
  nb::class_<EdgeFactors>(module, "EdgeFactors")
      .def(nb::init<double, double, double, double, double, double, bool, bool, double>(),
           nb::kw_only(), "alpha"_a, "eta_convex"_a, "crease_length"_a, "diagonal"_a, "ridges"_a,
           "evened"_a, "is_straight"_a, "all_sharp"_a, "slack"_a);
  module.def("triangle_weights", threaded(&weights_of_triangles), "surface"_a, "centroids"_a,
             "areas"_a, "normals"_a, "factors"_a, "wants_turn"_a, "is_counted"_a, "n_threads"_a);
  module.def("surface_weights", threaded(&weights_of_surface), "surface"_a, "factors"_a,
             "wants_turn"_a, "is_counted"_a, "n_threads"_a);
  module.def("point_weights", threaded(&weights_of_points), "surface"_a, "factors"_a,
             "n_threads"_a);
  module.def("stk02_weights", threaded(&stk02_of_triangles), "surface"_a, "centroids"_a, "alpha"_a,
             "n_threads"_a);
  module.def("polygon_stk02_weights", threaded(&stk02_of_polygons), "surface"_a, "alpha"_a,
             "n_threads"_a);
  module.def("add_feature_steps", threaded(&with_feature_steps), "offsets"_a, "neighbors"_a,
             "weights"_a, "features"_a.noconvert(), "factor"_a, "n_threads"_a);
  module.def("add_part_prices", threaded(&with_part_prices), "offsets"_a, "neighbors"_a,
             "lengths"_a, "group_of"_a, "vectors"_a.noconvert(), "factor"_a, "n_threads"_a);
  module.def("quantize_weights", threaded(&quantized), "weights"_a, "n_threads"_a);
  module.def("unit_of_lengths", &unit_of_lengths, "total_weight"_a);
  module.def("round_weights", threaded(&rounded), "weights"_a, "unit"_a, "n_threads"_a);
  module.def("sum_of", threaded(&sum_of), "values"_a, "n_threads"_a);
  module.def("texel_colors", threaded(&colors_of_texels), "pixels"_a, "width"_a, "height"_a,
             "wrap_u"_a, "wrap_v"_a, "linear"_a, "coordinates"_a, "corners"_a, "n_threads"_a);
  module.def("paint_ids", threaded(&painted_ids), "width"_a, "height"_a, "wrap_u"_a, "wrap_v"_a,
             "coordinates"_a, "corners"_a, "ids"_a, "bleed"_a, "n_threads"_a);
}

}  // namespace superfacets
