// Stage 1: which faces share an edge.
#pragma once

#include "types.hpp"

namespace superfacets {

// The largest number of arcs that is built: more than 2^24 arcs (half a gigabyte) are accepted only
// on meshes that need them by their size, not for one edge with five thousand faces on it.
inline constexpr std::int64_t kArcsAlwaysAllowed = std::int64_t{1} << 24;
inline constexpr std::int64_t kArcsPerFaceAllowed = 16;

// Undirected edges by the number of faces on them.
struct EdgeCounts {
  std::int64_t edges = 0;
  std::int64_t boundary = 0;      // one face
  std::int64_t non_manifold = 0;  // three faces or more
  std::int64_t inconsistent = 0;  // two faces that run through the edge in the same direction
};

struct FaceGraph {
  std::vector<std::int64_t> offsets;    // (F + 1,) arcs of face i: offsets[i] .. offsets[i+1]-1
  std::vector<Face> neighbors;          // (M,) the face an arc leads to
  std::vector<std::uint16_t> sides;     // (M,) the side 0, 1, 2 of the face that the arc leaves by
  std::vector<std::uint8_t> same_turn;  // (M,) 1 where both faces run through the edge alike
  EdgeCounts counts;
};

// Builds one arc per shared edge and direction. Side s of a face joins its corners s and s + 1;
// corners are compared by representative[vertex] (see weld_vertices). All pairs of faces around a
// non-manifold edge are neighbors; a boundary edge has no arc; a side whose two ends are one vertex
// is no edge; a face is never its own neighbor; faces that share two edges have two arcs. The arcs
// of a face are sorted by side, then by neighbor. Time O(F + M), memory about 36 bytes per face
// beside the result. Throws std::length_error where there are too many arcs (see above).
FaceGraph build_face_graph(std::span<const Triangle> faces, std::span<const Vertex> representative);

// Centroids and areas of faces: the positions and measures of their cells.
void measure_faces(std::span<const Point> vertices, std::span<const Triangle> faces, int n_threads,
                   std::span<Point> centroids, std::span<double> areas);

}  // namespace superfacets
