// Stage 5: a triangle mesh with labels, and the faces around each vertex.
#pragma once

#include "base/buffer.hpp"
#include "base/lists.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct LabeledMesh {
  std::span<const Point> vertices;
  std::span<const Triangle> faces;
  std::span<const Vertex> representative;  // see weld_vertices
  std::span<const Label> labels;           // (F,) 0..n_labels-1
  std::span<const std::uint8_t> is_kept;   // (F,) 1: the face and its borders stay as they are
  Label n_labels;
};

// Measures of a mesh and its topology by welded vertices.
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
  Lists<Face> faces_;  // by vertex
};

// Vertices through which borders keep running, 1 each: all corners of kept faces, and the ends of
// border edges
// - with three faces or more;
// - with a fold of 75 degrees or more, or of 40 if it runs on straight at one end at least, so that
//   it is a crease and not the roughness of a coarse mesh;
// and vertices of more than 64 faces. Time O(F), and O(n^2) at a border vertex with n faces.
Buffer<std::uint8_t> pinned_vertices(const LabeledMesh& mesh, const FacesAround& around,
                                     ThreadTeam& team);

}  // namespace superfacets
