#include "regions/labeled_mesh.hpp"

#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// Cosines of 75 degrees, kSharpAngle (cells/weights.hpp) and 30 degrees. With the limit of 75
// degrees, the edges of boxes are pinned. With a limit of 60 degrees, regions of the benchmark
// models would be 0.3% less compact, and with 40 degrees for all creases 1% less.
constexpr double kSharp = 0.2588190451025207;
constexpr double kFolded = 0.7660444431189780;
constexpr double kStraight = 0.8660254037844386;

// Maximum number of faces around a vertex whose edges are examined. Vertices with more faces are
// pinned.
constexpr std::size_t kMaxFaces = 64;

bool has_corner(const Triangle& face, Vertex vertex) {
  const auto& [a, b, c] = face.corners;
  return a == vertex || b == vertex || c == vertex;
}

// Whether the face traverses the edge from a to b, not from b to a.
bool leads_along(const Triangle& face, Vertex a, Vertex b) {
  const auto& [x, y, z] = face.corners;
  return (x == a && y == b) || (y == a && z == b) || (z == a && x == b);
}

// The faces on an edge.
struct EdgeFaces {
  Face first = -1;
  Face second = -1;
  int count = 0;
  bool separates = false;  // whether two of the faces have different labels
};

class Pins {
 public:
  Pins(const LabeledMesh& mesh, const FacesAround& around) : mesh_(mesh), around_(around) {}

  bool is_pinned(Vertex vertex) const {
    const std::span<const Face> faces = around_.of(vertex);
    if (faces.empty()) return false;
    const Label label = mesh_.labels[faces[0]];
    const bool is_inside =
        std::ranges::all_of(faces, [&](Face f) { return mesh_.labels[f] == label; });
    if (std::ranges::any_of(faces, [&](Face f) { return mesh_.is_kept[f] != 0; })) {
      return true;
    }
    if (is_inside) return false;
    return faces.size() > kMaxFaces ||
           std::ranges::any_of(faces, [&](Face face) { return has_kept_border(vertex, face); });
  }

 private:
  bool has_kept_border(Vertex vertex, Face face) const {
    const auto& corners = around_.corners(face).corners;
    return std::any_of(corners, corners + 3, [&](Vertex other) {
      return other != vertex && is_kept_border(vertex, other);
    });
  }

  bool is_kept_border(Vertex a, Vertex b) const {
    const EdgeFaces edge = faces_on(a, b);
    if (!edge.separates) return false;
    if (edge.count > 2) return true;
    const double cosine = cosine_of_fold(edge, a, b);
    return cosine <= kSharp || (cosine <= kFolded && (runs_on(a, b) || runs_on(b, a)));
  }

  EdgeFaces faces_on(Vertex a, Vertex b) const {
    EdgeFaces edge;
    for (const Face face : around_.of(a)) {
      if (!has_corner(around_.corners(face), b)) continue;
      if (edge.count == 0) edge.first = face;
      if (edge.count == 1) edge.second = face;
      edge.separates |= mesh_.labels[face] != mesh_.labels[edge.first];
      ++edge.count;
    }
    return edge;
  }

  // The cosine of the angle between the normals of the two faces of an edge; 1 if a face has no
  // normal.
  double cosine_of_fold(const EdgeFaces& edge, Vertex a, Vertex b) const {
    const Point& one = around_.normal(edge.first);
    const Point& other = around_.normal(edge.second);
    if (squared_norm(one) == 0.0 || squared_norm(other) == 0.0) return 1.0;
    const bool turned = leads_along(around_.corners(edge.first), a, b) ==
                        leads_along(around_.corners(edge.second), a, b);
    return turned ? -dot(one, other) : dot(one, other);
  }

  // Whether another folded edge continues the edge from a to b beyond b, in nearly the same
  // direction.
  bool runs_on(Vertex a, Vertex b) const {
    const std::span<const Face> faces = around_.of(b);
    return faces.size() <= kMaxFaces && std::ranges::any_of(faces, [&](Face face) {
             const auto& corners = around_.corners(face).corners;
             return std::any_of(corners, corners + 3,
                                [&](Vertex c) { return c != a && c != b && continues(a, b, c); });
           });
  }

  bool continues(Vertex a, Vertex b, Vertex c) const {
    const Point before = mesh_.vertices[b] - mesh_.vertices[a];
    const Point after = mesh_.vertices[c] - mesh_.vertices[b];
    if (dot(before, after) < kStraight * norm(before) * norm(after)) return false;
    const EdgeFaces edge = faces_on(b, c);
    return edge.count == 2 && cosine_of_fold(edge, b, c) <= kFolded;
  }

  const LabeledMesh& mesh_;
  const FacesAround& around_;
};

}  // namespace

FacesAround::FacesAround(const LabeledMesh& mesh, ThreadTeam& team)
    : corners_(mesh.faces.size()), areas_(mesh.faces.size()), normals_(mesh.faces.size()) {
  const std::span<const Vertex> lowest = mesh.representative;
  team.for_each_index(n_faces(), [&](std::int64_t face) {
    const auto& [a, b, c] = mesh.faces[face].corners;
    corners_[face] = {{lowest[a], lowest[b], lowest[c]}};
    areas_[face] = superfacets::area(mesh.vertices, mesh.faces[face]);
    normals_[face] = unit_normal(mesh.vertices, mesh.faces[face]);
  });
  faces_ = group<Face>(std::ssize(mesh.vertices), [&](const auto& add) {
    for (Face face = 0; face < n_faces(); ++face) {
      for (const Vertex corner : corners_[face].corners) add(corner, face);
    }
  });
}

Buffer<std::uint8_t> pinned_vertices(const LabeledMesh& mesh, const FacesAround& around,
                                     ThreadTeam& team) {
  SUPERFACETS_ASSERT(mesh.labels.size() == mesh.faces.size());
  SUPERFACETS_ASSERT(mesh.is_kept.size() == mesh.faces.size());
  const Pins pins(mesh, around);
  Buffer<std::uint8_t> are_pinned(mesh.vertices.size());
  team.for_each_index(around.n_vertices(), [&](std::int64_t vertex) {
    are_pinned[vertex] = pins.is_pinned(static_cast<Vertex>(vertex)) ? 1 : 0;
  });
  return are_pinned;
}

}  // namespace superfacets
