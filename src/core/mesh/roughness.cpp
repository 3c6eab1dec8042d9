#include "mesh/roughness.hpp"

#include <array>
#include <bit>
#include <limits>

#include "base/lists.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Maximum number of vertices and faces that are collected around a vertex. In a regular triangle
// mesh, there are 19 vertices and 36 faces: 24 faces in the two rings, and 12 adjacent faces. In a
// regular grid of squares, there are 25 vertices and 32 faces.
constexpr int kMaxVertices = 96;
constexpr int kMaxFaces = 256;

// Minimum pivot of the normal equations, as a fraction of the diagonal entry. A smaller pivot means
// that all points are on a conic, so that the fit is not unique.
constexpr double kMinPivot = 1e-9;

std::uint64_t code_of(std::uint64_t bits) {
  return bits * 0x9E3779B97F4A7C15;
}
std::uint64_t code_of(const Point& p) {
  const auto bits = [](double number) {  // adding 0 changes -0 to 0
    return std::bit_cast<std::uint64_t>(number + 0.0);
  };
  return code_of(bits(p.x) ^ std::rotl(bits(p.y), 21) ^ std::rotl(bits(p.z), 42));
}

// A Bloom filter for positions: may_have returns true for all positions that were added, and rarely
// for other positions.
class PositionFilter {
 public:
  void clear() { words_.fill(0); }
  void add(const Point& p) { words_[code_of(p) >> 61] |= bit(code_of(p)); }
  bool may_have(const Point& p) const { return (words_[code_of(p) >> 61] & bit(code_of(p))) != 0; }

 private:
  static std::uint64_t bit(std::uint64_t code) { return std::uint64_t{1} << (code >> 55 & 63); }
  std::array<std::uint64_t, 8> words_{};
};

// A set of at most kMaxFaces faces, as a hash table with open addressing.
class FaceSet {
 public:
  void clear() { table_.fill(kNoCell); }
  // Adds a face. Returns false if the set already contains the face.
  bool add(Face face) {
    std::size_t slot = code_of(static_cast<std::uint64_t>(face)) >> 55;
    while (table_[slot] != kNoCell) {
      if (table_[slot] == face) return false;
      slot = (slot + 1) % table_.size();
    }
    table_[slot] = face;
    return true;
  }

 private:
  std::array<Face, 512> table_{};
};

// A vertex (the center) with its first and second ring of neighbors; see measure_roughness.
class Surroundings {
 public:
  Surroundings(std::span<const Point> vertices, const CornerLists& corners,
               std::span<const std::int64_t> offsets, std::span<const Face> neighbors)
      : vertices_(vertices), corners_(corners), offsets_(offsets), neighbors_(neighbors) {}

  // Collects the two rings around the first corner of a face. Returns false if there are more than
  // kMaxVertices vertices or kMaxFaces faces.
  bool gather(Face face) {
    listed_.clear();
    known_.clear();
    listed_.add(face);
    faces_[0] = face;
    n_listed_ = 1;
    n_vertices_ = 0;
    add(corners_[face][0]);
    return gather_ring(1) && gather_ring(n_vertices_);
  }

  // Positions of the center, of the first ring (near), and of the second ring (far).
  const Point& center() const { return points_[0]; }
  std::span<const Point> near() const { return {points_.data() + 1, points_.data() + first_end_}; }
  std::span<const Point> far() const {
    return {points_.data() + first_end_, points_.data() + n_vertices_};
  }
  // Number of faces around the center; 0 if the center is on the boundary.
  int n_faces() const { return n_center_faces_; }
  const Point& normal() const { return normal_; }

 private:
  // Adds all vertices of the faces around the first n_inner vertices. Afterwards, faces_ contains
  // these faces first, followed by their neighbors. Returns false if there are too many vertices or
  // faces.
  bool gather_ring(int n_inner) {
    const bool is_first = n_inner == 1;
    if (is_first) normal_ = {0.0, 0.0, 0.0};
    int n_around = 0;  // faces_[0 .. n_around - 1] are around the inner vertices
    for (int next = 0; next < n_listed_; ++next) {
      const Face face = faces_[next];
      if (!touches(face, n_inner)) continue;
      std::swap(faces_[next], faces_[n_around]);
      ++n_around;
      for (const Vertex corner : corners_[face]) {
        if (place_of(corner, n_vertices_) < 0 && !add(corner)) return false;
      }
      if (is_first) add_normal(face);
      for (std::int64_t arc = offsets_[face]; arc < offsets_[face + 1]; ++arc) {
        if (!listed_.add(neighbors_[arc])) continue;
        if (n_listed_ == kMaxFaces) return false;
        faces_[n_listed_++] = neighbors_[arc];
      }
    }
    if (is_first) {
      first_end_ = n_vertices_;
      n_center_faces_ = is_closed(n_around) ? n_around : 0;
    }
    return true;
  }

  // Whether the n_around faces around the center form one closed ring, in which each face shares
  // one vertex of the first ring with the next face.
  bool is_closed(int n_around) const {
    std::int64_t n_corners = 0;  // number of corners that are not at the center
    for (const Face face : std::span(faces_).first(n_around)) {
      n_corners += std::ssize(corners_[face]) - 1;
    }
    return first_end_ - 1 == n_corners - n_around;
  }

  bool touches(Face face, int n_inner) const {
    return std::ranges::any_of(corners_[face],
                               [&](Vertex corner) { return place_of(corner, n_inner) >= 0; });
  }

  // Index of a vertex, or of a vertex at the same position, among the first n collected vertices;
  // -1 if there is none.
  int place_of(Vertex vertex, int n) const {
    for (int i = 0; i < n; ++i) {
      if (ids_[i] == vertex) return i;
    }
    const Point& point = vertices_[vertex];
    if (!known_.may_have(point)) return -1;
    for (int i = 0; i < n; ++i) {
      if (points_[i] == point) return i;
    }
    return -1;
  }

  bool add(Vertex vertex) {
    if (n_vertices_ == kMaxVertices) return false;
    known_.add(vertices_[vertex]);
    ids_[n_vertices_] = vertex;
    points_[n_vertices_++] = vertices_[vertex];
    return true;
  }

  // Adds the normal of a face, computed at the corner that is at the center.
  void add_normal(Face face) {
    const auto ring = corners_[face];
    const std::size_t n = ring.size();
    for (std::size_t i = 0; i < n; ++i) {
      if (place_of(ring[i], 1) < 0) continue;
      const Point normal = cross(vertices_[ring[(i + 1) % n]] - points_[0],
                                 vertices_[ring[(i + n - 1) % n]] - points_[0]);
      normal_ = normal_ + normal;
    }
  }

  const std::span<const Point> vertices_;
  const CornerLists& corners_;
  const std::span<const std::int64_t> offsets_;
  const std::span<const Face> neighbors_;
  FaceSet listed_;
  PositionFilter known_;
  std::array<Face, kMaxFaces> faces_{};
  std::array<Vertex, kMaxVertices> ids_{};
  std::array<Point, kMaxVertices> points_{};
  int n_listed_ = 0;
  int n_vertices_ = 0;
  int first_end_ = 0;
  int n_center_faces_ = 0;
  Point normal_{0.0, 0.0, 0.0};
};

// Least-squares fit of z = a x + b y + c x^2 + d x y + e y^2 + f to points.
class Quadric {
 public:
  void add(double x, double y, double z) {
    const std::array<double, kN + 1> row{x, y, x * x, x * y, y * y, 1.0, z};
    for (int i = 0; i < kN; ++i) {
      for (int j = i; j <= kN; ++j) sums_[i][j] += row[i] * row[j];
    }
  }
  void add(const Quadric& other) {
    for (int i = 0; i < kN; ++i) {
      for (int j = i; j <= kN; ++j) sums_[i][j] += other.sums_[i][j];
    }
  }

  // Absolute height of the origin above the surface, |f|, divided by the standard deviation that
  // this height has if the z of the origin and of all points are white noise of variance 1. NaN if
  // the fit is not unique.
  double height() const {
    auto a = sums_;
    for (int k = 0; k < kN; ++k) {
      if (!(a[k][k] > kMinPivot * sums_[k][k])) return kNaN;
      for (int i = k + 1; i < kN; ++i) {
        const double factor = a[k][i] / a[k][k];
        for (int j = i; j <= kN; ++j) a[i][j] -= factor * a[k][j];
      }
    }
    const double pivot = a[kN - 1][kN - 1];
    return std::abs(a[kN - 1][kN] / pivot) / std::sqrt(1.0 + 1.0 / pivot);
  }

 private:
  static constexpr int kN = 6;
  // Upper triangle and right-hand side of the normal equations.
  std::array<std::array<double, kN + 1>, kN> sums_{};
};

// Axes of a coordinate system whose z axis is the normal at the center. The unit of length is the
// mean distance from the center to the first ring.
struct Frame {
  Point x, y, z;

  // All axes are zero if the normal or the mean distance is zero.
  explicit Frame(const Surroundings& around) : x{}, y{}, z{} {
    double distance = 0.0;
    for (const Point& p : around.near()) distance += norm(p - around.center());
    distance /= static_cast<double>(around.near().size());
    const double length = norm(around.normal());
    const bool has_axes = distance > 0.0 && length > 0.0;  // the comparison is false for NaN
    if (!has_axes) return;
    const Point unit = (1.0 / length) * around.normal();
    const Point axis = std::abs(unit.x) < 0.6 ? Point{1.0, 0.0, 0.0} : Point{0.0, 1.0, 0.0};
    const Point side = cross(unit, axis);
    const Point first = (1.0 / norm(side)) * side;
    x = (1.0 / distance) * first;
    y = (1.0 / distance) * cross(unit, first);
    z = (1.0 / distance) * unit;
  }
};

struct Heights {
  double near = kNaN;
  double far = kNaN;
};

Heights heights_of(const Surroundings& around) {
  const Frame frame(around);
  const auto fit = [&](std::span<const Point> points) {
    Quadric quadric;
    for (const Point& p : points) {
      const Point step = p - around.center();
      quadric.add(dot(step, frame.x), dot(step, frame.y), dot(step, frame.z));
    }
    return quadric;
  };
  const Quadric far = fit(around.far());
  Quadric near = fit(around.near());
  near.add(far);
  const Heights heights{near.height(), far.height()};
  return std::isnan(heights.far) ? Heights{} : heights;
}

struct Plane {
  Point center;
  Point normal;  // not scaled to length 1
};

// The planes of some faces, each computed once. A polygon may be a neighbor across thousands of
// sides.
class Planes {
 public:
  // `faces` must be sorted.
  Planes(std::span<const Point> vertices, const CornerLists& corners, std::vector<Face> faces,
         ThreadTeam& team)
      : faces_(std::move(faces)), planes_(faces_.size()) {
    team.for_each_index(std::ssize(faces_), [&](std::int64_t i) {
      const auto ring = corners[faces_[i]];
      planes_[i] = {mean_corner(vertices, ring), double_area_vector(vertices, ring)};
    });
  }

  const Plane& operator[](Face face) const {
    return planes_[std::ranges::lower_bound(faces_, face) - faces_.begin()];
  }

 private:
  std::vector<Face> faces_;
  std::vector<Plane> planes_;
};

struct Bend {
  double fold = kNaN;
  double agreement = kNaN;
};

Bend bend_of(const Planes& planes, Face face, std::span<const Face> adjacent) {
  Bend bend;
  const Plane& own = planes[face];
  std::int64_t n_above = 0;
  for (const Face other : adjacent) {
    const Plane& plane = planes[other];
    if (dot(own.normal, plane.center - own.center) > 0.0) ++n_above;
    if (!std::isnan(bend.fold)) continue;
    bend.fold =
        std::atan2(norm(cross(own.normal, plane.normal)), std::abs(dot(own.normal, plane.normal)));
  }
  const auto n_pairs = [](std::int64_t n) { return static_cast<double>(n * (n - 1)) / 2.0; };
  const std::int64_t n = std::ssize(adjacent);
  if (n > 1) bend.agreement = (n_pairs(n_above) + n_pairs(n - n_above)) / n_pairs(n);
  return bend;
}

}  // namespace

Roughness measure_roughness(std::span<const Point> vertices, const CornerLists& corners,
                            std::span<const std::int64_t> offsets, std::span<const Face> neighbors,
                            std::span<const Face> faces, ThreadTeam& team) {
  const std::int64_t n = std::ssize(faces);
  const auto adjacent = [&](Face face) {
    return neighbors.subspan(offsets[face], offsets[face + 1] - offsets[face]);
  };
  std::vector<Face> needed(faces.begin(), faces.end());
  sort_unique(needed);
  for (std::size_t i = 0, n_faces = needed.size(); i < n_faces; ++i) {
    std::ranges::copy(adjacent(needed[i]), std::back_inserter(needed));
  }
  sort_unique(needed);
  const Planes planes(vertices, corners, std::move(needed), team);
  Roughness found{Buffer<double>(n), Buffer<double>(n), Buffer<double>(n), Buffer<double>(n),
                  Buffer<std::int32_t>(n)};
  team.for_each_block(
      n,
      [&](std::int64_t begin, std::int64_t end) {
        Surroundings around(vertices, corners, offsets, neighbors);
        for (std::int64_t i = begin; i < end; ++i) {
          const bool fits = around.gather(faces[i]);
          const Heights heights = fits ? heights_of(around) : Heights{};
          found.near[i] = heights.near;
          found.far[i] = heights.far;
          const Bend bend = bend_of(planes, faces[i], adjacent(faces[i]));
          found.fold[i] = bend.fold;
          found.agreement[i] = bend.agreement;
          found.n_faces[i] = fits ? around.n_faces() : 0;
        }
      },
      64);
  return found;
}

}  // namespace superfacets
