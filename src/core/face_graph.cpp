#include "face_graph.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>

#include "parallel.hpp"

namespace superfacets {
namespace {

// One side of one face, filed under the lower of its two vertices.
struct HalfEdge {
  Vertex high;  // the other vertex
  Face face;
  std::uint16_t side;
  bool ascending;  // the face runs from the lower to the higher vertex
};

struct Arc {
  Face neighbor;
  std::uint16_t side;
  std::uint8_t same_turn;
};

// Half-edges grouped by their lower vertex: those of vertex v are starts[v] .. starts[v + 1] - 1,
// sorted so that the sides on one edge stand together, in the order of their faces.
struct HalfEdges {
  std::vector<std::int64_t> starts;
  std::vector<HalfEdge> items;
};

template <typename Visit>
void for_each_side(std::span<const Triangle> faces, std::span<const Vertex> representative,
                   const Visit& visit) {
  for (std::size_t face = 0; face < faces.size(); ++face) {
    for (int side = 0; side < 3; ++side) {
      const Vertex from = representative[faces[face].corners[side]];
      const Vertex to = representative[faces[face].corners[(side + 1) % 3]];
      if (from != to) visit(static_cast<Face>(face), static_cast<std::uint16_t>(side), from, to);
    }
  }
}

HalfEdges group_half_edges(std::span<const Triangle> faces,
                           std::span<const Vertex> representative) {
  HalfEdges result;
  result.starts.assign(representative.size() + 1, 0);
  for_each_side(faces, representative, [&](Face, std::uint16_t, Vertex from, Vertex to) {
    ++result.starts[std::min(from, to) + 1];
  });
  for (std::size_t v = 1; v < result.starts.size(); ++v) result.starts[v] += result.starts[v - 1];

  result.items.resize(result.starts.back());
  std::vector<std::int64_t> next(result.starts.begin(), result.starts.end() - 1);  // free places
  for_each_side(faces, representative, [&](Face face, std::uint16_t side, Vertex from, Vertex to) {
    result.items[next[std::min(from, to)]++] = {std::max(from, to), face, side, from < to};
  });
  return result;
}

// Sorts the sides of each edge together and removes the second side where a degenerate face runs
// through one edge twice, so that no face meets itself.
void sort_and_trim(HalfEdges& half_edges) {
  auto key = [](const HalfEdge& h) { return std::tie(h.high, h.face, h.side); };
  auto same_place = [](const HalfEdge& a, const HalfEdge& b) {
    return a.high == b.high && a.face == b.face;
  };
  std::int64_t kept = 0;  // items[0 .. kept-1] are final
  for (std::size_t v = 0; v + 1 < half_edges.starts.size(); ++v) {
    const auto begin = half_edges.items.begin() + half_edges.starts[v];
    const auto end = half_edges.items.begin() + half_edges.starts[v + 1];
    std::sort(begin, end, [&](const auto& a, const auto& b) { return key(a) < key(b); });
    const auto last = std::unique(begin, end, same_place);
    half_edges.starts[v] = kept;
    kept = std::copy(begin, last, half_edges.items.begin() + kept) - half_edges.items.begin();
  }
  half_edges.starts.back() = kept;
  half_edges.items.resize(kept);
}

// Calls visit(sides) for the sides on each edge.
template <typename Visit>
void for_each_edge(const HalfEdges& half_edges, const Visit& visit) {
  for (std::size_t v = 0; v + 1 < half_edges.starts.size(); ++v) {
    std::int64_t begin = half_edges.starts[v];
    while (begin < half_edges.starts[v + 1]) {
      std::int64_t end = begin + 1;
      while (end < half_edges.starts[v + 1] &&
             half_edges.items[end].high == half_edges.items[begin].high) {
        ++end;
      }
      visit(std::span(half_edges.items).subspan(begin, end - begin));
      begin = end;
    }
  }
}

EdgeCounts count_edges(const HalfEdges& half_edges) {
  EdgeCounts counts;
  for_each_edge(half_edges, [&](std::span<const HalfEdge> sides) {
    ++counts.edges;
    if (sides.size() == 1) ++counts.boundary;
    if (sides.size() > 2) ++counts.non_manifold;
    if (sides.size() == 2 && sides[0].ascending == sides[1].ascending) ++counts.inconsistent;
  });
  return counts;
}

// offsets[i] = number of arcs of the faces before i. Arcs are counted before any is allocated.
std::vector<std::int64_t> count_arcs(const HalfEdges& half_edges, std::size_t n_faces) {
  std::vector<std::int64_t> offsets(n_faces + 1, 0);
  std::int64_t n_arcs = 0;
  std::int64_t most_faces = 0;  // on one edge
  for_each_edge(half_edges, [&](std::span<const HalfEdge> sides) {
    const auto others = static_cast<std::int64_t>(sides.size()) - 1;
    for (const HalfEdge& side : sides) offsets[side.face + 1] += others;
    n_arcs += others * (others + 1);
    most_faces = std::max(most_faces, others + 1);
  });
  const auto limit =
      std::max(kArcsAlwaysAllowed, kArcsPerFaceAllowed * static_cast<std::int64_t>(n_faces));
  if (n_arcs > limit) {
    throw std::length_error("the mesh has " + std::to_string(n_arcs) +
                            " pairs of neighboring faces, more than the limit of " +
                            std::to_string(limit) + "; one edge is shared by " +
                            std::to_string(most_faces) + " faces");
  }
  for (std::size_t face = 1; face < offsets.size(); ++face) offsets[face] += offsets[face - 1];
  return offsets;
}

std::vector<Arc> collect_arcs(const HalfEdges& half_edges, std::span<const std::int64_t> offsets) {
  std::vector<Arc> arcs(offsets.back());
  std::vector<std::int64_t> next(offsets.begin(), offsets.end() - 1);  // free place of each face
  for_each_edge(half_edges, [&](std::span<const HalfEdge> sides) {
    for (const HalfEdge& from : sides) {
      for (const HalfEdge& to : sides) {
        if (from.face == to.face) continue;
        const std::uint8_t same_turn = from.ascending == to.ascending;
        arcs[next[from.face]++] = {to.face, from.side, same_turn};
      }
    }
  });
  return arcs;
}

void sort_arcs(std::span<const std::int64_t> offsets, std::vector<Arc>& arcs) {
  auto key = [](const Arc& arc) { return std::tie(arc.side, arc.neighbor); };
  for (std::size_t face = 0; face + 1 < offsets.size(); ++face) {
    std::sort(arcs.begin() + offsets[face], arcs.begin() + offsets[face + 1],
              [&](const Arc& a, const Arc& b) { return key(a) < key(b); });
  }
}

}  // namespace

FaceGraph build_face_graph(std::span<const Triangle> faces,
                           std::span<const Vertex> representative) {
  HalfEdges half_edges = group_half_edges(faces, representative);
  sort_and_trim(half_edges);
  FaceGraph graph;
  graph.counts = count_edges(half_edges);
  graph.offsets = count_arcs(half_edges, faces.size());
  std::vector<Arc> arcs = collect_arcs(half_edges, graph.offsets);
  half_edges = {};  // gives its memory back before the result takes its own
  sort_arcs(graph.offsets, arcs);

  graph.neighbors.reserve(arcs.size());
  graph.sides.reserve(arcs.size());
  graph.same_turn.reserve(arcs.size());
  for (const Arc& arc : arcs) {
    graph.neighbors.push_back(arc.neighbor);
    graph.sides.push_back(arc.side);
    graph.same_turn.push_back(arc.same_turn);
  }
  return graph;
}

void measure_faces(std::span<const Point> vertices, std::span<const Triangle> faces, int n_threads,
                   std::span<Point> centroids, std::span<double> areas) {
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  parallel_ranges(n_faces, n_threads, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      const auto& corners = faces[face].corners;
      const Point a = vertices[corners[0]];
      const Point b = vertices[corners[1]];
      const Point c = vertices[corners[2]];
      const Point sum = a + b + c;
      centroids[face] = {sum.x / 3.0, sum.y / 3.0, sum.z / 3.0};
      areas[face] = 0.5 * norm(cross(b - a, c - a));
    }
  });
}

}  // namespace superfacets
