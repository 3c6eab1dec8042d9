#include "cells/triangle_graph.hpp"

#include "base/prefetch.hpp"

namespace superfacets {
namespace {

// The sides of triangles, in the form that build_side_graph requires.
struct TriangleSides {
  using Key = Vertex;

  std::span<const Triangle> faces;
  Welding representative;

  Face n_cells() const { return static_cast<Face>(faces.size()); }
  std::int64_t n_vertices() const { return representative.n_vertices(); }
  static std::int64_t first_place(std::int64_t face) { return 3 * face; }
  void prefetch(Face face) const { superfacets::prefetch(&faces[face]); }

  // Visits the sides that join two different vertices.
  template <typename Visit>
  void for_each_side(Face face, const Visit& visit) const {
    Triangle ends = faces[face];
    for (Vertex& end : ends.corners) end = representative[end];
    for (int side = 0; side < 3; ++side) {
      const Vertex from = ends.corners[side];
      const Vertex to = ends.corners[next_corner(side)];
      // No branch, because the order of the vertices is unpredictable.
      const Vertex low = to ^ ((from ^ to) & -Vertex{from < to});
      if (from != to) visit(side, low, from ^ to ^ low, from < to);
    }
  }
};

}  // namespace

TriangleGraph build_triangle_graph(std::span<const Triangle> faces,
                                   std::span<const Vertex> representative, ThreadTeam& team) {
  return build_side_graph<std::uint8_t>(TriangleSides{faces, Welding(representative)}, team);
}

}  // namespace superfacets
