#include "cells/polygon_graph.hpp"

#include "base/prefetch.hpp"

namespace superfacets {
namespace {

// The sides of polygons, in the form that build_side_graph requires.
struct PolygonSides {
  using Key = Vertex;

  const Polygons& faces;
  Welding representative;

  Face n_cells() const { return static_cast<Face>(faces.n_faces()); }
  std::int64_t n_vertices() const { return representative.n_vertices(); }
  std::int64_t first_place(std::int64_t face) const { return faces.offsets[face]; }
  void prefetch(Face face) const { superfacets::prefetch(&faces.corners[faces.offsets[face]]); }

  // Visits the sides that join two different vertices.
  template <typename Visit>
  void for_each_side(Face face, const Visit& visit) const {
    const std::span<const Vertex> corners = faces[face];
    const Vertex first = representative[corners[0]];
    Vertex from = first;
    for (std::size_t side = 0; side < corners.size(); ++side) {
      const Vertex to = side + 1 == corners.size() ? first : representative[corners[side + 1]];
      const auto [low, high] = std::minmax(from, to);
      if (low != high) {
        visit(static_cast<std::int32_t>(side), low, high, from < to);
      }
      from = to;
    }
  }
};

}  // namespace

PolygonGraph build_polygon_graph(const Polygons& faces, std::span<const Vertex> representative,
                                 ThreadTeam& team) {
  SUPERFACETS_ASSERT(faces.are_valid());
  return build_side_graph<std::int32_t>(PolygonSides{faces, Welding(representative)}, team);
}

}  // namespace superfacets
