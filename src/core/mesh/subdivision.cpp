// Rivara's algorithm bisects the longest side of a face, then neighboring faces that do not
// conform, then their neighbors. Here only sides that are too long are bisected, which avoids such
// chains: if any side of a face is too long, its longest side is too long. Hence each side that is
// too long is eventually bisected in each of its faces. Faces are therefore independent, except for
// the indices of midpoints on shared sides.
//
// The algorithm is from Rivara, "Algorithms for refining triangular grids suitable for adaptive and
// multigrid techniques", 1984. The bound on angles that subdivision.hpp states is from Rosenberg
// and Stenger, "A lower bound on the angles of triangles constructed by bisecting the longest
// side", 1975.
#include "mesh/subdivision.hpp"

#include <limits>
#include <stdexcept>

#include "base/lists.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// Number of faces per task. The number is small, because one large face may be cut into thousands
// of parts.
constexpr std::int64_t kFacesPerTask = 256;

constexpr Vertex kNoVertex = -1;
constexpr int kNoSide = -1;

Point midpoint(const Point& a, const Point& b) {
  return {std::midpoint(a.x, b.x), std::midpoint(a.y, b.y), std::midpoint(a.z, b.z)};
}

using Corners = std::array<Point, 3>;

// Returns the corners with one of them moved to `point`. If `point` is the midpoint of a side, the
// result is one half of the face.
Corners with(const Corners& face, int corner, const Point& point) {
  Corners changed = face;
  changed[corner] = point;
  return changed;
}

// Decides which sides are too long. Swapping the ends of a side changes no bit of its length and
// midpoint.
class Limit {
 public:
  explicit Limit(double max_edge) : squared_(max_edge * max_edge) {}

  bool is_exceeded(const Point& a, const Point& b) const { return squared_norm(b - a) > squared_; }

  // Returns the longest side if it is too long, and kNoSide otherwise.
  int longest_side(const Corners& corners) const {
    double longest = squared_;
    int longest_side = kNoSide;
    for (int side = 0; side < 3; ++side) {
      const double length = squared_norm(corners[next_corner(side)] - corners[side]);
      if (length > longest) {
        longest = length;
        longest_side = side;
      }
    }
    return longest_side;
  }

 private:
  double squared_;
};

// Returns the number of parts of a face, or any number larger than `most` if the face has more than
// `most` parts.
std::int64_t count_parts(const Corners& face, const Limit& limit, std::int64_t most) {
  const int side = limit.longest_side(face);
  if (side == kNoSide) return 1;
  const int end = next_corner(side);
  const Point middle = midpoint(face[side], face[end]);
  const std::int64_t n_first = count_parts(with(face, end, middle), limit, most - 1);
  if (n_first >= most) return most + 1;  // the other half adds at least one part
  return n_first + count_parts(with(face, side, middle), limit, most - n_first);
}

[[noreturn]] void refuse() {
  throw std::length_error("the subdivision would have too many faces");
}

// Prefix sum of the number of parts per face, (F + 1,).
Buffer<std::int64_t> place_parts(std::span<const Point> vertices, std::span<const Triangle> faces,
                                 const Limit& limit, std::int64_t max_faces, ThreadTeam& team) {
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  Buffer<std::int64_t> starts(n_faces + 1);
  std::atomic<std::int64_t> total = 0;
  const auto count = [&](std::int64_t face) {
    if (total.load(std::memory_order_relaxed) > max_faces) return;
    starts[face] = count_parts(corners_of(vertices, faces[face]), limit, max_faces);
    if (starts[face] > 1) total.fetch_add(starts[face] - 1, std::memory_order_relaxed);
  };
  total = n_faces;
  team.for_each_index(n_faces, count, kFacesPerTask);
  if (total > max_faces) refuse();
  const auto n_vertices = static_cast<std::int64_t>(vertices.size());
  if (n_vertices + total - n_faces > std::numeric_limits<Vertex>::max()) refuse();
  starts[n_faces] = 0;
  std::exclusive_scan(starts.begin(), starts.end(), starts.begin(), std::int64_t{0});
  return starts;
}

Vertex count_points(const Point& a, const Point& b, const Limit& limit) {
  if (!limit.is_exceeded(a, b)) return 0;
  const Point middle = midpoint(a, b);
  return 1 + count_points(a, middle, limit) + count_points(middle, b, limit);
}

// Writes the midpoints of an edge in recursive order: first the midpoint of the edge, then the
// midpoints of the half at a, then the midpoints of the half at b. Returns the end of the output.
Point* write_points(const Point& a, const Point& b, const Limit& limit, Point* place) {
  if (!limit.is_exceeded(a, b)) return place;
  const Point middle = midpoint(a, b);
  *place = middle;
  return write_points(middle, b, limit, write_points(a, middle, limit, place + 1));
}

// Calls visit(lower vertex, higher vertex) for each side that is too long.
template <typename Visit>
void for_each_long_side(std::span<const Point> vertices, std::span<const Triangle> faces,
                        const Limit& limit, const Visit& visit) {
  for (const Triangle& face : faces) {
    for (int side = 0; side < 3; ++side) {
      const auto [low, high] = std::minmax(face.corners[side], face.corners[next_corner(side)]);
      if (limit.is_exceeded(vertices[low], vertices[high])) visit(low, high);
    }
  }
}

// The edges of the mesh that are too long, each given by its two vertices, and the midpoints on
// these edges.
class LongEdges {
 public:
  LongEdges(std::span<const Point> vertices, std::span<const Triangle> faces, const Limit& limit,
            ThreadTeam& team)
      : highs_(group<Vertex>(std::ssize(vertices), [&](const auto& add) {
          for_each_long_side(vertices, faces, limit, add);
        })) {
    sort_unique(highs_, team);
    first_points_ = Buffer<Vertex>(n_edges() + 1);
    auto next = static_cast<Vertex>(vertices.size());
    for (Vertex low = 0; low < highs_.n_lists(); ++low) {
      for (std::int64_t edge = highs_.offsets[low]; edge < highs_.offsets[low + 1]; ++edge) {
        first_points_[edge] = next;
        next += count_points(vertices[low], vertices[highs_.entries[edge]], limit);
      }
    }
    first_points_[n_edges()] = next;
  }

  // Index of the first midpoint on an edge, and number of its midpoints. Midpoints of an edge have
  // consecutive indices, in the order of write_points from the lower to the higher vertex.
  struct Points {
    Vertex first;
    Vertex count;
  };
  Points points(Vertex a, Vertex b) const {
    const auto highs = highs_[std::min(a, b)];
    const auto place = std::ranges::lower_bound(highs, std::max(a, b));
    const std::int64_t edge = highs_.offsets[std::min(a, b)] + (place - highs.begin());
    return {first_points_[edge], first_points_[edge + 1] - first_points_[edge]};
  }

  // One past the index of the last midpoint on an edge of the mesh.
  Vertex end() const { return first_points_[n_edges()]; }

  void write(const Limit& limit, ThreadTeam& team, std::span<Point> vertices) const {
    team.for_each_index(highs_.n_lists(), [&](std::int64_t low) {
      for (std::int64_t edge = highs_.offsets[low]; edge < highs_.offsets[low + 1]; ++edge) {
        Point* place = &vertices[first_points_[edge]];
        write_points(vertices[low], vertices[highs_.entries[edge]], limit, place);
      }
    });
  }

 private:
  std::int64_t n_edges() const { return std::ssize(highs_.entries); }

  // list i: the higher vertices of the edges whose lower vertex is i, ascending
  Lists<Vertex> highs_;
  Buffer<Vertex> first_points_;  // (edges + 1,) index of the first midpoint of each edge
};

// Cuts one face at a time, and writes its parts and inner midpoints into preallocated arrays.
class Cutter {
 public:
  Cutter(const Limit& limit, const LongEdges& long_edges, Subdivision& parts)
      : limit_(limit), long_edges_(long_edges), parts_(parts) {}

  // Writes the parts of a face from index first_part on, and the midpoints inside the face from
  // index first_point on. Midpoints on the sides must have been written before.
  void cut(const Triangle& face, Face source, std::int64_t first_part, Vertex first_point) {
    edges_.clear();
    source_ = source;
    next_part_ = first_part;
    next_point_ = first_point;
    const auto& [a, b, c] = face.corners;
    cut(Sides{{add_side(a, b), add_side(b, c), add_side(c, a)}}, 0);
  }

 private:
  // A side of the face, an edge inside the face, or a part of such an edge.
  struct SplitEdge {
    Vertex from;
    Vertex to;
    Vertex middle = kNoVertex;  // midpoint, if the edge is bisected into two other edges
    std::int32_t first_half = 0;
    std::int32_t second_half = 0;
  };

  // An edge, and the direction in which a part of the face traverses this edge.
  struct Side {
    std::int32_t edge;
    bool is_reversed;
  };
  struct Sides {
    Side sides[3];

    Sides with(int first, const Side& one, int second, const Side& other) const {
      Sides changed = *this;
      changed.sides[first] = one;
      changed.sides[second] = other;
      return changed;
    }
  };

  const Point& point(Vertex vertex) const { return parts_.vertices[vertex]; }

  Vertex start(const Side& side) const {
    const SplitEdge& edge = edges_[side.edge];
    return side.is_reversed ? edge.to : edge.from;
  }
  Side half_at_start(const Side& side) const {
    const SplitEdge& edge = edges_[side.edge];
    return {side.is_reversed ? edge.second_half : edge.first_half, side.is_reversed};
  }
  Side half_at_end(const Side& side) const {
    const SplitEdge& edge = edges_[side.edge];
    return {side.is_reversed ? edge.first_half : edge.second_half, side.is_reversed};
  }

  // Adds an edge and, recursively, its halves. Its midpoints must have been written from next_point
  // on, in the order of write_points.
  std::int32_t add_edge(Vertex from, Vertex to, Vertex& next_point) {
    const auto index = static_cast<std::int32_t>(edges_.size());
    edges_.push_back({from, to});
    if (!limit_.is_exceeded(point(from), point(to))) return index;
    const Vertex middle = next_point++;
    const std::int32_t first_half = add_edge(from, middle, next_point);
    const std::int32_t second_half = add_edge(middle, to, next_point);
    edges_[index] = {from, to, middle, first_half, second_half};
    return index;
  }

  // Adds a side of the face. The edge runs from the lower to the higher vertex, like the midpoints
  // of the edge.
  Side add_side(Vertex a, Vertex b) {
    const bool is_reversed = a > b;
    Vertex next_point = kNoVertex;
    if (limit_.is_exceeded(point(a), point(b))) next_point = long_edges_.points(a, b).first;
    return {add_edge(std::min(a, b), std::max(a, b), next_point), is_reversed};
  }

  // Adds an edge from a midpoint to the opposite corner.
  std::int32_t add_inner_edge(Vertex middle, Vertex opposite) {
    // A pointer is used, because next_point_ may be one past the last vertex. In this case the edge
    // is short, and nothing is written.
    Point* place = parts_.vertices.data() + next_point_;
    write_points(point(middle), point(opposite), limit_, place);
    return add_edge(middle, opposite, next_point_);
  }

  void cut(const Sides& face, std::uint8_t depth) {
    const auto& [ab, bc, ca] = face.sides;
    const Triangle corners{{start(ab), start(bc), start(ca)}};
    const int side = limit_.longest_side(corners_of(parts_.vertices.span(), corners));
    if (side == kNoSide) {
      write_part(corners, depth);
      return;
    }
    const int second = next_corner(side);
    const int third = next_corner(second);
    const Side bisected = face.sides[side];
    const std::int32_t inner = add_inner_edge(edges_[bisected.edge].middle, corners.corners[third]);
    cut(face.with(side, half_at_start(bisected), second, {inner, false}), depth + 1);
    cut(face.with(side, half_at_end(bisected), third, {inner, true}), depth + 1);
  }

  void write_part(const Triangle& corners, std::uint8_t depth) {
    parts_.faces[next_part_] = corners;
    parts_.sources[next_part_] = source_;
    parts_.depths[next_part_] = depth;
    ++next_part_;
  }

  const Limit& limit_;
  const LongEdges& long_edges_;
  Subdivision& parts_;
  std::vector<SplitEdge> edges_;  // edges of the current face
  Face source_ = 0;
  std::int64_t next_part_ = 0;
  Vertex next_point_ = 0;
};

// Index of the first inner midpoint of each face, (F + 1,). Each bisection of a part needs one
// midpoint. A midpoint on a side of the face serves one bisection, and a midpoint inside the face
// serves two.
Buffer<Vertex> place_inner_points(std::span<const Point> vertices, std::span<const Triangle> faces,
                                  const Limit& limit, const LongEdges& long_edges,
                                  std::span<const std::int64_t> starts, ThreadTeam& team) {
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  Buffer<Vertex> first_points(n_faces + 1);
  team.for_each_index(n_faces, [&](std::int64_t face) {
    auto n_points = static_cast<Vertex>(starts[face + 1] - starts[face] - 1);
    for (int side = 0; side < 3; ++side) {
      const Vertex a = faces[face].corners[side];
      const Vertex b = faces[face].corners[next_corner(side)];
      if (limit.is_exceeded(vertices[a], vertices[b])) n_points -= long_edges.points(a, b).count;
    }
    first_points[face] = n_points / 2;
  });
  first_points[n_faces] = 0;
  std::exclusive_scan(first_points.begin(), first_points.end(), first_points.begin(),
                      long_edges.end());
  return first_points;
}

}  // namespace

Subdivision subdivide(std::span<const Point> vertices, std::span<const Triangle> faces,
                      double max_edge, std::int64_t max_faces, ThreadTeam& team) {
  SUPERFACETS_ASSERT(max_edge > 0.0);
  const Limit limit(max_edge);
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  const Buffer<std::int64_t> starts = place_parts(vertices, faces, limit, max_faces, team);
  const LongEdges long_edges(vertices, faces, limit, team);
  const Buffer<Vertex> first_points =
      place_inner_points(vertices, faces, limit, long_edges, starts.span(), team);

  const auto n_parts = static_cast<std::size_t>(starts[n_faces]);
  Subdivision parts{Buffer<Point>(first_points[n_faces]), Buffer<Triangle>(n_parts),
                    Buffer<Face>(n_parts), Buffer<std::uint8_t>(n_parts)};
  std::ranges::copy(vertices, parts.vertices.begin());
  long_edges.write(limit, team, parts.vertices.span());
  const auto cut_faces = [&](std::int64_t begin, std::int64_t end) {
    Cutter cutter(limit, long_edges, parts);
    for (std::int64_t face = begin; face < end; ++face) {
      cutter.cut(faces[face], static_cast<Face>(face), starts[face], first_points[face]);
    }
  };
  team.for_each_block(n_faces, cut_faces, kFacesPerTask);
  return parts;
}

}  // namespace superfacets
