#include "cells/polygon_graph.hpp"

#include "cells/side_graph.hpp"

namespace superfacets {
namespace {

// The sides of polygons, in the form that list_sides requires.
struct PolygonSides {
  const Polygons& faces;
  std::span<const Vertex> representative;

  Face n_cells() const { return static_cast<Face>(faces.n_faces()); }
  std::int64_t n_vertices() const { return std::ssize(representative); }
  std::int64_t first_place(Face face) const { return faces.offsets[face]; }

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
        visit(static_cast<std::int32_t>(side), low, static_cast<SideKey>(high), from < to);
      }
      from = to;
    }
  }
};

}  // namespace

PolygonGraph build_polygon_graph(const Polygons& faces, std::span<const Vertex> representative,
                                 ThreadTeam& team) {
  SUPERFACETS_ASSERT(faces.are_valid());
  return build_side_graph(PolygonSides{faces, representative}, team);
}

}  // namespace superfacets
