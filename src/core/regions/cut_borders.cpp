#include "regions/cut_borders.hpp"

#include <limits>
#include <stdexcept>

namespace superfacets {
namespace {

// The two unwelded vertices of an edge, the lower vertex first.
using Ends = std::pair<Vertex, Vertex>;

class Cutter {
 public:
  Cutter(const LabeledMesh& mesh, const BorderField& field, ThreadTeam& team)
      : mesh_(mesh), field_(field), team_(team) {}

  CutMesh run() {
    find_parts();
    find_edges();
    allocate();
    write_crossings();
    write_faces();
    return std::move(result_);
  }

 private:
  std::int64_t n_faces() const { return std::ssize(mesh_.faces); }

  void find_parts() {
    starts_ = Buffer<std::int64_t>(n_faces() + 1);
    junctions_ = Buffer<std::int64_t>(n_faces() + 1);
    team_.for_each_index(n_faces(), [&](std::int64_t face) {
      const FaceCut cut = field_.cut_of(static_cast<Face>(face));
      starts_[face] = cut.n_parts();
      junctions_[face] = cut.n_cuts == 3 ? 1 : 0;
    });
    starts_[n_faces()] = junctions_[n_faces()] = 0;
    std::exclusive_scan(starts_.begin(), starts_.end(), starts_.begin(), std::int64_t{0});
    std::exclusive_scan(junctions_.begin(), junctions_.end(), junctions_.begin(), std::int64_t{0});
  }

  bool is_cut(Face face) const { return starts_[face + 1] - starts_[face] > 1; }

  Ends ends_of(Face face, int side) const {
    const auto& corners = mesh_.faces[face].corners;
    return std::minmax(corners[side], corners[next_corner(side)]);
  }

  void find_edges() {
    for (Face face = 0; face < n_faces(); ++face) {
      if (!is_cut(face)) continue;
      const FaceCut cut = field_.cut_of(face);
      for (int side = 0; side < 3; ++side) {
        if (cut.is_cut(side)) edges_.push_back(ends_of(face, side));
      }
    }
    sort_unique(edges_);
  }

  void allocate() {
    first_crossing_ = std::ssize(mesh_.vertices);
    first_junction_ = first_crossing_ + std::ssize(edges_);
    const std::int64_t n_vertices = first_junction_ + junctions_[n_faces()];
    const std::int64_t n_parts = starts_[n_faces()];
    if (std::max(n_vertices, n_parts) > std::numeric_limits<Vertex>::max()) {
      throw std::length_error("the cut mesh would have too many faces");
    }
    result_ = {Buffer<Point>(n_vertices), Buffer<Triangle>(n_parts), Buffer<Label>(n_parts),
               Buffer<Face>(n_parts)};
    std::ranges::copy(mesh_.vertices, result_.vertices.begin());
  }

  // Writes the crossings on edges. The crossings are interpolated from the lower to the higher
  // welded vertex, so that crossings on both sides of an unwelded seam have the same bits.
  void write_crossings() {
    team_.for_each_index(std::ssize(edges_), [&](std::int64_t edge) {
      const auto [low, high] = std::minmax(mesh_.representative[edges_[edge].first],
                                           mesh_.representative[edges_[edge].second]);
      const Point step = mesh_.vertices[high] - mesh_.vertices[low];
      result_.vertices[first_crossing_ + edge] =
          mesh_.vertices[low] + field_.crossing(low, high) * step;
    });
  }

  void write_faces() {
    team_.for_each_index(n_faces(), [&](std::int64_t face) {
      Parts parts{result_, static_cast<Face>(face), starts_[face]};
      write_face(static_cast<Face>(face), parts);
    });
  }

  // Appends the parts of one face.
  struct Parts {
    CutMesh& result;
    Face source;
    std::int64_t next;

    void add(Vertex a, Vertex b, Vertex c, Label label) {
      result.faces[next] = {{a, b, c}};
      result.labels[next] = label;
      result.sources[next] = source;
      ++next;
    }
  };

  void write_face(Face face, Parts& parts) {
    const FaceCut cut = field_.cut_of(face);
    const auto& [a, b, c] = mesh_.faces[face].corners;
    if (cut.n_cuts == 0) return parts.add(a, b, c, cut.whole);
    if (cut.n_cuts == 1) return write_two(face, cut, parts);
    if (cut.n_cuts == 2) return write_corner(face, cut, parts);
    write_three(face, cut, parts);
  }

  Vertex crossing_vertex(Face face, int side) const {
    const auto place = std::ranges::lower_bound(edges_, ends_of(face, side));
    return static_cast<Vertex>(first_crossing_ + (place - edges_.begin()));
  }

  // Writes the two parts of a face cut from one corner to the opposite side.
  void write_two(Face face, const FaceCut& cut, Parts& parts) const {
    const auto& corners = mesh_.faces[face].corners;
    const int side = cut.side_where(true);
    const int end = next_corner(side);
    const Vertex apex = corners[next_corner(end)];
    const Vertex crossing = crossing_vertex(face, side);
    parts.add(corners[side], crossing, apex, cut.labels[side]);
    parts.add(crossing, corners[end], apex, cut.labels[end]);
  }

  // Shape quality of a triangle: 0 if it is degenerate, 2 / sqrt(3) if it is equilateral.
  double roundness(Vertex a, Vertex b, Vertex c) const {
    const auto& points = result_.vertices;
    const Point ab = points[b] - points[a];
    const Point bc = points[c] - points[b];
    const Point ca = points[a] - points[c];
    const double sum = squared_norm(ab) + squared_norm(bc) + squared_norm(ca);
    return sum > 0.0 ? 4.0 * norm(cross(ab, bc)) / sum : 0.0;
  }

  // Writes the three parts of a face with two cut sides: the corner that is cut off, and two
  // triangles of the remaining quadrilateral, which is split along the diagonal that gives rounder
  // triangles.
  void write_corner(Face face, const FaceCut& cut, Parts& parts) const {
    const auto& corners = mesh_.faces[face].corners;
    const int uncut = cut.side_where(false);
    const int odd = previous_corner(uncut);
    const Vertex a = corners[uncut];
    const Vertex b = corners[next_corner(uncut)];
    const Vertex near_a = crossing_vertex(face, odd);
    const Vertex near_b = crossing_vertex(face, next_corner(uncut));
    const Label label = cut.labels[uncut];
    parts.add(corners[odd], near_a, near_b, cut.labels[odd]);
    const double one = std::min(roundness(near_a, a, b), roundness(near_a, b, near_b));
    const double other = std::min(roundness(near_a, a, near_b), roundness(a, b, near_b));
    if (one >= other) {
      parts.add(near_a, a, b, label);
      parts.add(near_a, b, near_b, label);
    } else {
      parts.add(near_a, a, near_b, label);
      parts.add(a, b, near_b, label);
    }
  }

  // Writes the six parts of a face with three cut sides. The parts meet at the junction.
  void write_three(Face face, const FaceCut& cut, Parts& parts) {
    const Vertex crossings[] = {crossing_vertex(face, 0), crossing_vertex(face, 1),
                                crossing_vertex(face, 2)};
    const std::span<Point> points = result_.vertices.span();
    const auto junction = static_cast<Vertex>(first_junction_ + junctions_[face]);
    const auto& [a, b, c] = mesh_.faces[face].corners;
    const auto [at_a, at_b, at_c] = cut.junction();
    points[junction] = at_a * points[a] + at_b * points[b] + at_c * points[c];
    for (int corner = 0; corner < 3; ++corner) {
      const Vertex at = mesh_.faces[face].corners[corner];
      parts.add(at, crossings[corner], junction, cut.labels[corner]);
      parts.add(at, junction, crossings[previous_corner(corner)], cut.labels[corner]);
    }
  }

  const LabeledMesh& mesh_;
  const BorderField& field_;
  ThreadTeam& team_;
  Buffer<std::int64_t> starts_;      // (F + 1,) index of the first part of each face
  Buffer<std::int64_t> junctions_;   // (F + 1,) number of junctions in the preceding faces
  std::vector<Ends> edges_;          // edges that are cut, sorted by their vertices
  std::int64_t first_crossing_ = 0;  // index of the first crossing among the new vertices
  std::int64_t first_junction_ = 0;  // index of the first junction among the new vertices
  CutMesh result_;
};

}  // namespace

CutMesh cut_borders(const LabeledMesh& mesh, const CutOptions& options, ThreadTeam& team) {
  SUPERFACETS_ASSERT(mesh.representative.size() == mesh.vertices.size());
  const FacesAround around(mesh, team);
  BorderField field(mesh, around, options, team);
  field.run();
  return Cutter(mesh, field, team).run();
}

}  // namespace superfacets
