// Stage 5: a triangle mesh with labels, the faces around each vertex, and the vertices at which
// borders must not move.
#pragma once

#include "base/lists.hpp"

namespace superfacets {

struct LabeledMesh {
  std::span<const Point> vertices;
  std::span<const Triangle> faces;
  std::span<const Vertex> representative;  // (V,) representative of each vertex; see weld_vertices
  std::span<const Label> labels;           // (F,) label of each face, 0..n_labels-1
  std::span<const std::uint8_t> is_kept;   // (F,) 1 if the face and its corners must not change
  Label n_labels;
};

// Normals and welded corners of the faces, and the faces around each welded vertex.
class FacesAround {
 public:
  FacesAround(const LabeledMesh& mesh, ThreadTeam& team);

  // The faces with a corner at a vertex, ascending.
  std::span<const Face> of(Vertex vertex) const { return faces_[vertex]; }
  // The corners of a face as welded vertices.
  const Triangle& corners(Face face) const { return corners_[face]; }
  double area(Face face) const { return areas_[face]; }
  const Point& normal(Face face) const { return normals_[face]; }  // zero if the face has no normal
  std::int64_t n_faces() const { return std::ssize(corners_.span()); }
  std::int64_t n_vertices() const { return faces_.n_lists(); }

 private:
  Buffer<Triangle> corners_;
  Buffer<double> areas_;
  Buffer<Point> normals_;
  Lists<Face> faces_;  // faces around each vertex
};

// Marks with 1 the vertices at which borders must not move: all corners of kept faces, border
// vertices with more than 64 faces, and the ends of some border edges. An edge pins its ends if it
// has at least three faces, or if its two faces meet at an angle of at least 75 degrees. An edge
// with an angle of 40 to 75 degrees pins its ends only if another edge with an angle of at least 40
// degrees continues it nearly straight. Otherwise the angle may be due to the roughness of a coarse
// mesh. Time O(F), and O(n^2) at a border vertex with n faces.
Buffer<std::uint8_t> pinned_vertices(const LabeledMesh& mesh, const FacesAround& around,
                                     ThreadTeam& team);

}  // namespace superfacets
