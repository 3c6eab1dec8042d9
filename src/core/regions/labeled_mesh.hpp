// Stage 5: a triangle mesh with labels, its faces around each vertex, and the vertices that borders
// keep.
#pragma once

#include "base/lists.hpp"

namespace superfacets {

struct LabeledMesh {
  std::span<const Point> vertices;
  std::span<const Triangle> faces;
  std::span<const Vertex> representative;  // see weld_vertices
  std::span<const Label> labels;           // (F,) 0..n_labels-1
  std::span<const std::uint8_t> is_kept;   // (F,) 1: the face and its borders do not change
  Label n_labels;
};

// Normals and welded corners of the faces, and the faces around each welded vertex.
class FacesAround {
 public:
  FacesAround(const LabeledMesh& mesh, ThreadTeam& team);

  // Faces with a corner at a vertex, ascending.
  std::span<const Face> of(Vertex vertex) const { return faces_[vertex]; }
  // The corners of a face as welded vertices.
  const Triangle& corners(Face face) const { return corners_[face]; }
  double area(Face face) const { return areas_[face]; }
  const Point& normal(Face face) const { return normals_[face]; }  // zero if it has none
  std::int64_t n_faces() const { return std::ssize(corners_.span()); }
  std::int64_t n_vertices() const { return faces_.n_lists(); }

 private:
  Buffer<Triangle> corners_;
  Buffer<double> areas_;
  Buffer<Point> normals_;
  Lists<Face> faces_;  // faces around each vertex
};

// Marks (1) the vertices at which borders must not move: all corners of kept faces, vertices of
// more than 64 faces, and the ends of border edges - with at least three faces; - with a fold of at
// least 75 degrees, or of at least 40 degrees if a folded edge continues it straight at one end or
// both, which shows a crease and not the roughness of a coarse mesh. Time O(F), and O(n^2) at a
// border vertex with n faces.
Buffer<std::uint8_t> pinned_vertices(const LabeledMesh& mesh, const FacesAround& around,
                                     ThreadTeam& team);

}  // namespace superfacets
