#include "cells/triangle_graph.hpp"

#include <array>

#include "base/lists.hpp"
#include "base/prefetch.hpp"

namespace superfacets {
namespace {

// Prefetch distance: the corners of a face are prefetched this number of faces in advance.
constexpr std::size_t kAhead = 16;

// Vertices are split into parts of at least 2^kMinPartBits vertices, so that the edges of a part
// are matched within the second-level cache. The number of parts is limited, because a processor
// core writes efficiently to only a limited number of streams.
constexpr int kMinPartBits = 12;
constexpr std::int64_t kMaxParts = 1024;

// Number of faces per parallel task that counts or writes arcs.
constexpr std::int64_t kBlock = 1 << 14;

// The corners of faces, with welded vertices replaced by their representative.
class WeldedCorners {
 public:
  WeldedCorners(std::span<const Triangle> faces, std::span<const Vertex> representative,
                ThreadTeam& team)
      : faces_(faces), representative_(representative) {
    SUPERFACETS_ASSERT(are_representatives(representative));
    if (is_identity(representative, team)) representative_ = {};
  }

  std::int64_t n_faces() const { return static_cast<std::int64_t>(faces_.size()); }

  void prefetch(Face face) const { superfacets::prefetch(&faces_[face]); }

  Vertex operator()(Face face, int corner) const {
    const Vertex vertex = faces_[face].corners[corner];
    return representative_.empty() ? vertex : representative_[vertex];
  }

 private:
  // Whether each representative represents itself, and its index is not higher than the indices of
  // the vertices that it represents.
  static bool are_representatives(std::span<const Vertex> representative) {
    for (std::size_t v = 0; v < representative.size(); ++v) {
      const Vertex lowest = representative[v];
      if (std::cmp_greater(lowest, v) || representative[lowest] != lowest) return false;
    }
    return true;
  }

  // Whether every vertex represents itself, as in most meshes. If so, reading a corner needs one
  // fewer memory access.
  static bool is_identity(std::span<const Vertex> representative, ThreadTeam& team) {
    std::atomic<bool> is_same = true;
    const auto n = static_cast<std::int64_t>(representative.size());
    team.for_each_block(n, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t v = begin; v < end && is_same.load(std::memory_order_relaxed); ++v) {
        if (representative[v] != v) is_same.store(false, std::memory_order_relaxed);
      }
    });
    return is_same;
  }

  std::span<const Triangle> faces_;
  // (V,) representative of each vertex; empty if each vertex represents itself.
  std::span<const Vertex> representative_;
};

// Calls visit(side, from, to) for the sides of a face that join two different vertices.
template <typename Visit>
void for_each_side(const WeldedCorners& corners, Face face, const Visit& visit) {
  const Vertex ends[] = {corners(face, 0), corners(face, 1), corners(face, 2)};
  for (int side = 0; side < 3; ++side) {
    const Vertex from = ends[side];
    const Vertex to = ends[next_corner(side)];
    if (from != to) visit(side, from, to);
  }
}

// Calls visit(face, part) for faces begin .. end-1. A part is a range of vertices. A face is
// visited once for each part that contains the lower vertex of one of its sides; see link_faces.
template <typename Visit>
void for_each_filing(const WeldedCorners& corners, std::int64_t begin, std::int64_t end,
                     int part_bits, const Visit& visit) {
  for (std::int64_t i = begin; i < end; ++i) {
    const auto face = static_cast<Face>(i);
    const Vertex a = corners(face, 0);
    const Vertex b = corners(face, 1);
    const Vertex c = corners(face, 2);
    const Vertex lowest = std::min(std::min(a, b), c);
    const Vertex middle = std::max(std::min(a, b), std::min(std::max(a, b), c));
    visit(face, lowest >> part_bits);
    if (lowest >> part_bits != middle >> part_bits) visit(face, middle >> part_bits);
  }
}

// How many other faces share the edge on a side of a face. For a single other face, also the
// direction in which that face traverses the edge.
enum class Link : std::uint8_t {
  kNone,     // no other face: a boundary edge, or a side that is not an edge
  kOpposed,  // one other face, which traverses the edge in the opposite direction
  kAlike,    // one other face, which traverses the edge in the same direction
  kRing,     // at least two other faces
  kCrowd,    // at least kMostPaired other faces
};

// One side of one face. The vertices of the side are not stored, because its position in the lists
// implies them.
class Side {
 public:
  Side() = default;
  Side(Face face, int side, bool is_ascending)
      : bits_(static_cast<std::uint64_t>(face) << 3U | std::uint64_t{is_ascending} << 2U |
              static_cast<std::uint64_t>(side)) {}

  Face face() const { return static_cast<Face>(bits_ >> 3U); }
  // Whether the face traverses the side from the lower to the higher vertex.
  bool is_ascending() const { return (bits_ & 4U) != 0; }
  std::int64_t place() const { return 3 * std::int64_t{face()} + static_cast<int>(bits_ & 3U); }

 private:
  std::uint64_t bits_ = 0;
};

// Circular linked lists of the faces on each edge, in ascending order. next[3 * face + side] is the
// next face on the edge or, where the link is kCrowd, an index in `crowds`. Where the link is
// kNone, `next` has no meaning.
struct Rings {
  Buffer<Face> next;
  Buffer<Link> links;
  // The sides on each edge of more than kMostPaired faces, ascending. The order of the edges
  // depends on the threads.
  std::vector<std::vector<Side>> crowds;
  std::mutex mutex;  // protects `crowds`
};

// The sides whose lower vertex is in a given range of vertices, grouped by lower vertex.
class SidesOfPart {
 public:
  void sort(const WeldedCorners& corners, std::span<const Face> faces, int part_bits,
            std::int64_t part) {
    const auto for_each_lower_end = [&](const auto& visit) {
      for (std::size_t i = 0; i < faces.size(); ++i) {
        if (i + kAhead < faces.size()) corners.prefetch(faces[i + kAhead]);
        for_each_side(corners, faces[i], [&](int side, Vertex from, Vertex to) {
          const Vertex low = std::min(from, to);
          if (low >> part_bits == part) {
            visit(low & ((1 << part_bits) - 1), faces[i], side, from, to);
          }
        });
      }
    };
    // The sides of vertex v are counted in starts[v + 2]. After the prefix sum, starts[v + 1] is
    // the write cursor of v. After all sides are written, this cursor is the start of vertex v + 1.
    starts_.assign((std::size_t{1} << part_bits) + 2, 0);
    for_each_lower_end([&](Vertex v, Face, int, Vertex, Vertex) { ++starts_[v + 2]; });
    for (std::size_t v = 1; v < starts_.size(); ++v) starts_[v] += starts_[v - 1];
    reserve(starts_.back());
    for_each_lower_end([&](Vertex v, Face face, int side, Vertex from, Vertex to) {
      const std::int64_t place = starts_[v + 1]++;
      highs_[place] = std::max(from, to);
      sides_[place] = {face, side, from < to};
    });
  }

  std::size_t n_vertices() const { return starts_.size() - 2; }
  std::span<const Side> sides(std::size_t vertex) const {
    return sides_.span().subspan(starts_[vertex], starts_[vertex + 1] - starts_[vertex]);
  }
  // The higher vertices of the sides whose lower vertex is `vertex`. The array is padded, so that
  // kReadable numbers can be read from the returned pointer.
  const Vertex* highs(std::size_t vertex) const { return highs_.data() + starts_[vertex]; }
  static constexpr std::size_t kReadable = 16;

 private:
  void reserve(std::size_t n_sides) {
    if (sides_.size() >= n_sides) return;
    highs_ = Buffer<Vertex>(n_sides + kReadable);
    std::ranges::fill(highs_, 0);
    sides_ = Buffer<Side>(n_sides);
  }

  std::vector<std::int64_t> starts_;
  Buffer<Vertex> highs_;
  Buffer<Side> sides_;
};

// For each of n <= kMost sides with the same lower vertex, the number of sides that also have the
// same higher vertex, and the sum of the indices of these sides. Vector instructions compare all
// pairs, without branches or sorting.
template <std::size_t kMost>
struct Matches {
  // Reads kMost numbers, and ignores all numbers after the first n.
  Matches(const Vertex* highs, std::size_t n) {
    for (std::size_t j = 0; j < n; ++j) {
      const Vertex high = highs[j];
      for (std::size_t i = 0; i < kMost; ++i) {
        const std::int32_t equal = highs[i] == high ? -1 : 0;
        counts[i] -= equal;
        sums[i] += equal & static_cast<std::int32_t>(j);
      }
    }
  }

  std::array<std::int32_t, kMost> counts{};
  std::array<std::int32_t, kMost> sums{};
};

void sort(std::span<std::uint64_t> values) {
  constexpr std::size_t kFew =
      24;  // up to this number of values, insertion sort is faster than std::sort
  if (values.size() > kFew) {
    std::ranges::sort(values);
    return;
  }
  for (std::size_t i = 1; i < values.size(); ++i) {
    const std::uint64_t value = values[i];
    std::size_t place = i;
    for (; place > 0 && value < values[place - 1]; --place) values[place] = values[place - 1];
    values[place] = value;
  }
}

// Links the sides that share an edge, for one part of the vertices after another.
class Linker {
 public:
  Linker(const WeldedCorners& corners, Rings& rings) : corners_(corners), rings_(rings) {}

  const EdgeTally& tally() const { return tally_; }

  // Links all sides of the given faces whose lower vertex is in the given part.
  void link_part(std::span<const Face> faces, int part_bits, std::int64_t part) {
    sides_.sort(corners_, faces, part_bits, part);
    for (std::size_t vertex = 0; vertex < sides_.n_vertices(); ++vertex) {
      const auto sides = sides_.sides(vertex);
      const auto highs = sides_.highs(vertex);
      const bool is_done =
          sides.size() <= kFew ? link_pairs<kFew>(sides, highs) : link_pairs<kMany>(sides, highs);
      if (!is_done) link_edges(sides, highs);
    }
  }

 private:
  // The lower vertex of a side is the end with the lower index. The faster version of link_pairs is
  // used for vertices that are the lower vertex of at most kFew sides. The mean is six sides.
  static constexpr std::size_t kFew = 8;
  static constexpr std::size_t kMany = SidesOfPart::kReadable;

  // Tries to link the sides with the same lower vertex. Returns false, and links nothing, if there
  // are more than kMost sides, or if an edge has two sides of one face or more than two sides.
  template <std::size_t kMost>
  bool link_pairs(std::span<const Side> sides, const Vertex* highs) {
    const std::size_t n = sides.size();
    if (n > kMost) return false;
    const Matches<kMost> matches(highs, n);
    // for each side, the other side on the same edge; the side itself if the edge has only one
    std::array<Side, kMost> others;
    bool is_simple = true;
    for (std::size_t i = 0; i < n; ++i) {
      const bool is_paired = matches.counts[i] == 2;
      others[i] = sides[is_paired ? matches.sums[i] - i : i];
      is_simple &= matches.counts[i] <= 2 && is_paired == (others[i].face() != sides[i].face());
    }
    if (!is_simple) return false;
    std::int64_t n_alone = 0;
    std::int64_t n_alike = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const bool is_alone = matches.counts[i] == 1;
      const bool is_alike = !is_alone && sides[i].is_ascending() == others[i].is_ascending();
      const std::int64_t place = sides[i].place();
      rings_.next[place] = others[i].face();
      rings_.links[place] = is_alone ? Link::kNone : pair_link(is_alike);
      n_alone += static_cast<std::int64_t>(is_alone);
      n_alike += static_cast<std::int64_t>(is_alike);
    }
    const auto n_paired = static_cast<std::int64_t>(n) - n_alone;
    tally_.add({{n_alone + n_paired / 2, n_alone, 0, n_alike / 2},
                static_cast<std::uint64_t>(n_paired),
                n_paired > 0 ? 2 : std::int64_t{n_alone > 0}});
    return true;
  }

  static Link pair_link(bool is_alike) { return is_alike ? Link::kAlike : Link::kOpposed; }

  // Links any number of sides with the same lower vertex, after sorting them by their higher
  // vertex.
  void link_edges(std::span<const Side> sides, const Vertex* highs) {
    constexpr int kPlaceBits = 33;  // bits of a side index, for three sides of each of 2^31 faces
    order_.resize(sides.size());
    for (std::size_t i = 0; i < sides.size(); ++i) {
      order_[i] = static_cast<std::uint64_t>(highs[i]) << kPlaceBits | i;
    }
    sort(order_);
    for (std::size_t i = 0; i < sides.size();) {
      const std::uint64_t high = order_[i] >> kPlaceBits;
      edge_.clear();
      for (; i < sides.size() && order_[i] >> kPlaceBits == high; ++i) {
        const Side side = sides[order_[i] & ((std::uint64_t{1} << kPlaceBits) - 1)];
        // A degenerate face may have two sides on one edge. The second side is dropped, so that no
        // face is its own neighbor.
        const bool is_second = !edge_.empty() && edge_.back().face() == side.face();
        if (!is_second) edge_.push_back(side);
      }
      link_edge(edge_);
    }
  }

  // Links the sides on one edge. The sides belong to different faces, in ascending order.
  void link_edge(std::span<const Side> sides) {
    const std::size_t n = sides.size();
    Link link = n == 1 ? Link::kNone : Link::kRing;
    if (n == 2) link = pair_link(sides[0].is_ascending() == sides[1].is_ascending());
    tally_.count(n, link == Link::kAlike);
    if (std::cmp_greater(n, kMostPaired)) return link_crowd(sides);
    for (std::size_t i = 0; i < n; ++i) {
      SUPERFACETS_ASSERT(i == 0 || sides[i - 1].face() < sides[i].face());
      rings_.next[sides[i].place()] = sides[i + 1 < n ? i + 1 : 0].face();
      rings_.links[sides[i].place()] = link;
    }
  }

  void link_crowd(std::span<const Side> sides) {
    const std::scoped_lock lock(rings_.mutex);
    for (const Side side : sides) {
      rings_.next[side.place()] = static_cast<Face>(rings_.crowds.size());
      rings_.links[side.place()] = Link::kCrowd;
    }
    rings_.crowds.emplace_back(sides.begin(), sides.end());
  }

  const WeldedCorners& corners_;
  Rings& rings_;
  SidesOfPart sides_;
  // Sort keys of the sides at one vertex: the higher vertex in 31 bits, then the index in 33.
  std::vector<std::uint64_t> order_;
  std::vector<Side> edge_;
  EdgeTally tally_;  // numbers of edges and arcs, summed over all parts
};

EdgeTally link_faces(const WeldedCorners& corners, std::int64_t n_vertices, ThreadTeam& team,
                     Rings& rings) {
  int part_bits = kMinPartBits;  // the part of a vertex is vertex >> part_bits
  while ((n_vertices >> part_bits) >= kMaxParts) ++part_bits;
  // Faces grouped by the parts of the lower vertices of their sides. A face is in at most two
  // parts, because its highest vertex is not the lower vertex of any side. Most faces are in one.
  const Lists<Face> parts = group<Face>(
      corners.n_faces(), (n_vertices >> part_bits) + 1,
      [&](std::int64_t begin, std::int64_t end, const auto& add) {
        for_each_filing(corners, begin, end, part_bits,
                        [&](Face face, Vertex part) { add(part, face); });
      },
      team);
  std::vector<Linker> linkers;
  linkers.reserve(team.size());
  for (int thread = 0; thread < team.size(); ++thread) linkers.emplace_back(corners, rings);
  team.for_each(parts.n_lists(), [&](std::int64_t part, int thread) {
    linkers[thread].link_part(parts[part], part_bits, part);
  });
  EdgeTally total;
  for (const Linker& linker : linkers) total.add(linker.tally());
  return total;
}

struct FaceArc {
  Face neighbor;
  bool same_turn;
};

// Converts rings (linked lists of the faces on each edge) to arcs.
class ArcReader {
 public:
  ArcReader(const WeldedCorners& corners, const Rings& rings) : corners_(corners), rings_(rings) {}

  Link link(Face face, int side) const { return rings_.links[place(face, side)]; }
  Face next(Face face, int side) const { return rings_.next[place(face, side)]; }

  std::int64_t count(Face face, int side) const {
    if (link(face, side) == Link::kCrowd) return count_linked(std::ssize(crowd(face, side)));
    if (link(face, side) != Link::kRing) return link(face, side) != Link::kNone;
    std::int64_t n_others = 0;
    walk_ring(face, side, [&](FaceArc) { ++n_others; });
    return n_others;
  }

  // Lists the neighbors of a face across an edge with three or more faces, in ascending order.
  void collect_ring(Face face, int side, std::vector<FaceArc>& arcs) const {
    arcs.clear();
    if (link(face, side) == Link::kCrowd) {
      walk_crowd(face, side, [&](FaceArc arc) { arcs.push_back(arc); });
    } else {
      walk_ring(face, side, [&](FaceArc arc) { arcs.push_back(arc); });
    }
    std::ranges::sort(arcs,
                      [](const FaceArc& a, const FaceArc& b) { return a.neighbor < b.neighbor; });
  }

 private:
  static std::int64_t place(Face face, int side) { return 3 * std::int64_t{face} + side; }

  const std::vector<Side>& crowd(Face face, int side) const {
    return rings_.crowds[next(face, side)];
  }

  template <typename Visit>
  void walk_crowd(Face face, int side, const Visit& visit) const {
    const std::vector<Side>& sides = crowd(face, side);
    const auto own = std::ranges::lower_bound(sides, face, {}, &Side::face);
    for_each_linked(std::ssize(sides), own - sides.begin(), [&](std::int64_t i) {
      visit(FaceArc{sides[i].face(), sides[i].is_ascending() == own->is_ascending()});
    });
  }

  template <typename Visit>
  void walk_ring(Face face, int side, const Visit& visit) const {
    const Vertex from = corners_(face, side);
    const Vertex to = corners_(face, (side + 1) % 3);
    for (Face other = next(face, side); other != face;) {
      const int other_side = side_along(other, from, to);
      visit(FaceArc{other, corners_(other, other_side) == from});
      other = next(other, other_side);
    }
  }

  // The first side of the face that joins the two vertices. A second side that joins the same
  // vertices has been dropped by link_edges.
  int side_along(Face face, Vertex a, Vertex b) const {
    for (int side = 0; side < 2; ++side) {
      const Vertex from = corners_(face, side);
      const Vertex to = corners_(face, side + 1);
      if ((from == a && to == b) || (from == b && to == a)) return side;
    }
    return 2;
  }

  const WeldedCorners& corners_;
  const Rings& rings_;
};

// Writes the arcs of faces begin .. end-1, beginning at offsets[begin].
void write_arcs(const ArcReader& reader, std::int64_t begin, std::int64_t end,
                TriangleGraph& graph) {
  std::int64_t place = graph.offsets[begin];
  const auto write = [&](Face neighbor, int side, bool same_turn) {
    graph.neighbors[place] = neighbor;
    graph.sides[place] = static_cast<std::uint8_t>(side);
    graph.same_turn[place] = static_cast<std::uint8_t>(same_turn);
    ++place;
  };
  std::vector<FaceArc> ring;
  for (std::int64_t i = begin; i < end; ++i) {
    const auto face = static_cast<Face>(i);
    graph.offsets[i] = place;
    for (int side = 0; side < 3; ++side) {
      const Link link = reader.link(face, side);
      if (link == Link::kNone) continue;
      if (link != Link::kRing && link != Link::kCrowd) {
        write(reader.next(face, side), side, link == Link::kAlike);
        continue;
      }
      reader.collect_ring(face, side, ring);
      for (const FaceArc& arc : ring) write(arc.neighbor, side, arc.same_turn);
    }
  }
}

std::int64_t count_arcs(const ArcReader& reader, std::int64_t begin, std::int64_t end) {
  std::int64_t n_arcs = 0;
  for (std::int64_t face = begin; face < end; ++face) {
    for (int side = 0; side < 3; ++side) n_arcs += reader.count(static_cast<Face>(face), side);
  }
  return n_arcs;
}

void collect_arcs(const ArcReader& reader, std::int64_t n_faces, ThreadTeam& team,
                  TriangleGraph& graph) {
  graph.offsets = Buffer<std::int64_t>(n_faces + 1);
  team.for_each_block(
      n_faces,
      [&](std::int64_t begin, std::int64_t end) {
        graph.offsets[begin] = count_arcs(reader, begin, end);
      },
      kBlock);
  std::int64_t total = 0;
  for (std::int64_t begin = 0; begin < n_faces; begin += kBlock) {
    total += std::exchange(graph.offsets[begin], total);
  }
  graph.offsets[n_faces] = total;
  graph.neighbors = Buffer<Face>(total);
  graph.sides = Buffer<std::uint8_t>(total);
  graph.same_turn = Buffer<std::uint8_t>(total);
  team.for_each_block(
      n_faces, [&](std::int64_t begin, std::int64_t end) { write_arcs(reader, begin, end, graph); },
      kBlock);
}

// Moves the rings into the graph without a copy. Requires exactly one arc per side of each face,
// because the rings then equal the lists of arcs.
void take_rings(Rings&& rings, std::int64_t n_faces, ThreadTeam& team, TriangleGraph& graph) {
  graph.offsets = Buffer<std::int64_t>(n_faces + 1);
  graph.offsets[n_faces] = 3 * n_faces;
  graph.neighbors = std::move(rings.next);
  graph.sides = Buffer<std::uint8_t>(3 * n_faces);
  graph.same_turn = Buffer<std::uint8_t>(3 * n_faces);
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) graph.offsets[face] = 3 * face;
    for (std::int64_t arc = 3 * begin; arc < 3 * end; ++arc) {
      graph.sides[arc] = static_cast<std::uint8_t>(arc % 3);
      graph.same_turn[arc] = static_cast<std::uint8_t>(rings.links[arc] == Link::kAlike);
    }
  });
}

}  // namespace

TriangleGraph build_triangle_graph(std::span<const Triangle> faces,
                                   std::span<const Vertex> representative, ThreadTeam& team) {
  const WeldedCorners corners(faces, representative, team);
  const std::int64_t n_faces = corners.n_faces();
  Rings rings{Buffer<Face>(3 * n_faces), Buffer<Link>(3 * n_faces), {}, {}};
  team.fill(rings.links.span(), Link::kNone);
  const auto n_vertices = static_cast<std::int64_t>(representative.size());
  const EdgeTally tally = link_faces(corners, n_vertices, team, rings);
  check_number_of_arcs(tally, n_faces);

  TriangleGraph graph;
  graph.counts = tally.edges;
  if (tally.edges.non_manifold == 0 && std::cmp_equal(tally.arcs, 3 * n_faces)) {
    take_rings(std::move(rings), n_faces, team, graph);
  } else {
    collect_arcs(ArcReader(corners, rings), n_faces, team, graph);
  }
  return graph;
}

}  // namespace superfacets
