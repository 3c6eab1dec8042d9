// Stage 1: the graph of faces that share an edge.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// The limit of the number of arcs is the larger of 2^24 (half a gigabyte) and 16 per face. It
// accepts any ordinary large mesh, and rejects a small mesh with thousands of faces on a few edges.
inline constexpr std::int64_t kArcsAlwaysAllowed = std::int64_t{1} << 24;
inline constexpr std::int64_t kArcsPerFaceAllowed = 16;

// Number of edges of each type.
struct EdgeCounts {
  std::int64_t edges = 0;
  std::int64_t boundary = 0;      // edges with one face
  std::int64_t non_manifold = 0;  // edges with at least three faces
  std::int64_t inconsistent = 0;  // edges whose two faces traverse them in the same direction
};

// Numbers of edges and arcs of a mesh.
struct EdgeTally {
  EdgeCounts edges;
  std::uint64_t arcs = 0;  // sum of n (n - 1) over edges with n faces; no overflow, as n < 2^31
  std::int64_t most_faces = 0;  // maximum number of faces on one edge

  void add(const EdgeTally& other);
  // Adds an edge with n_faces faces.
  void count(std::size_t n_faces, bool is_inconsistent);
};

// Throws std::length_error if there are too many arcs for a mesh with n_faces faces.
void check_number_of_arcs(const EdgeTally& tally, std::int64_t n_faces);

struct FaceGraph {
  Buffer<std::int64_t> offsets;    // (F + 1,) arcs of face i: offsets[i] .. offsets[i+1]-1
  Buffer<Face> neighbors;          // (M,) target face of each arc
  Buffer<std::uint8_t> sides;      // (M,) side of the face, 0, 1 or 2, that each arc crosses
  Buffer<std::uint8_t> same_turn;  // (M,) 1 if both faces traverse the edge in the same direction
  EdgeCounts counts;
};

// Builds one arc per shared edge and direction. Side s of a face joins its corners s and s + 1. Two
// corners are equal if their vertices have the same representative (see weld_vertices). All pairs
// of faces around a non-manifold edge are neighbors. A boundary edge has no arc. A side whose two
// ends are the same vertex is not an edge. A face is never its own neighbor: if two sides of a face
// are on one edge, only the first is used. Faces that share two edges are joined by two arcs in
// each direction. The arcs of a face are sorted by side, then by neighbor. The mesh has at most
// 2^31 - 1 faces and vertices; sides and arcs are counted in 64 bits.
//
// Time O(F + V + M), and O(n log n) at a vertex with n edges. Memory in addition to the result: at
// most about 36 bytes per face. Throws std::length_error before it allocates arcs, if there are too
// many arcs (see check_number_of_arcs).
FaceGraph build_face_graph(std::span<const Triangle> faces, std::span<const Vertex> representative,
                           ThreadTeam& team);

}  // namespace superfacets
