#include "cells/tet_graph.hpp"

#include <array>

#include "base/prefetch.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// The three corners of each side of a tetrahedron, in ascending order.
constexpr std::array<std::array<int, 3>, 4> kSides = {{{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}}};

// The sides of tetrahedra, in the form that build_side_graph requires.
struct TetSides {
  using Key = std::uint64_t;  // the middle and the highest vertex

  std::span<const Tet> tets;
  Welding representative;

  Cell n_cells() const { return static_cast<Cell>(tets.size()); }
  std::int64_t n_vertices() const { return representative.n_vertices(); }
  static std::int64_t first_place(std::int64_t tet) { return 4 * tet; }
  void prefetch(Cell tet) const { superfacets::prefetch(&tets[tet]); }

  template <typename Visit>
  void for_each_side(Cell tet, const Visit& visit) const {
    for (int side = 0; side < 4; ++side) {
      std::array<Vertex, 3> v{};
      for (int i = 0; i < 3; ++i) v[i] = representative[tets[tet].corners[kSides[side][i]]];
      std::ranges::sort(v);
      if (v[0] == v[1] || v[1] == v[2]) continue;
      const Key key = static_cast<Key>(v[1]) << 32U | static_cast<Key>(v[2]);
      visit(side, v[0], key, side % 2 == 0);  // the direction has no meaning for tetrahedra
    }
  }
};

// The triangle of a side, with its vertices sorted by position. Two tetrahedra may have different
// vertices at the same position, so sorting by position gives both the same triangle.
Triangle side_of(std::span<const Point> vertices, const Tet& tet, int side) {
  Triangle triangle{};
  for (int i = 0; i < 3; ++i) triangle.corners[i] = tet.corners[kSides[side][i]];
  std::sort(std::begin(triangle.corners), std::end(triangle.corners),
            [&](Vertex a, Vertex b) { return vertices[a] < vertices[b]; });
  return triangle;
}

Point centroid_of(std::span<const Point> vertices, const Tet& tet) {
  const auto& [a, b, c, d] = tet.corners;
  return 0.25 * ((vertices[a] + vertices[b]) + (vertices[c] + vertices[d]));
}

double volume_of(std::span<const Point> vertices, const Tet& tet) {
  const Point& a = vertices[tet.corners[0]];
  const Point u = vertices[tet.corners[1]] - a;
  const Point v = vertices[tet.corners[2]] - a;
  const Point w = vertices[tet.corners[3]] - a;
  return std::abs(dot(u, cross(v, w))) / 6.0;
}

void measure_arcs_of(std::span<const Point> vertices, std::span<const Tet> tets,
                     const TetGraph& graph, Cell tet, TetMeasures& measures) {
  std::array<bool, 4> is_crossed{};
  for (std::int64_t arc = graph.offsets[tet]; arc < graph.offsets[tet + 1]; ++arc) {
    is_crossed[graph.sides[arc]] = true;
    const Triangle triangle = side_of(vertices, tets[tet], graph.sides[arc]);
    const Point middle = centroid(vertices, triangle);
    measures.border_areas[arc] = area(vertices, triangle);
    measures.step_lengths[arc] = norm(measures.centroids[tet] - middle) +
                                 norm(middle - measures.centroids[graph.neighbors[arc]]);
  }
  double open = 0.0;
  for (int side = 0; side < 4; ++side) {
    if (!is_crossed[side]) open += area(vertices, side_of(vertices, tets[tet], side));
  }
  measures.open_areas[tet] = open;
}

}  // namespace

TetGraph build_tet_graph(std::span<const Tet> tets, std::span<const Vertex> representative,
                         ThreadTeam& team) {
  return build_side_graph<std::int32_t>(TetSides{tets, Welding(representative)}, team);
}

TetMeasures measure_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                         const TetGraph& graph, ThreadTeam& team) {
  const std::size_t n_arcs = graph.neighbors.size();
  TetMeasures measures{Buffer<Point>(tets.size()), Buffer<double>(tets.size()),
                       Buffer<double>(n_arcs), Buffer<double>(n_arcs), Buffer<double>(tets.size())};
  team.for_each_index(std::ssize(tets), [&](std::int64_t tet) {
    measures.centroids[tet] = centroid_of(vertices, tets[tet]);
    measures.volumes[tet] = volume_of(vertices, tets[tet]);
  });
  team.for_each_index(std::ssize(tets),
                      [&](Cell tet) { measure_arcs_of(vertices, tets, graph, tet, measures); });
  return measures;
}

}  // namespace superfacets
