#include "spatial/sorted_mesh.hpp"

#include "base/lists.hpp"
#include "base/prefetch.hpp"
#include "mesh/weld.hpp"
#include "spatial/morton.hpp"

namespace superfacets {
namespace {

// Maximum number of vertices with the same Morton code that are sorted by position only.
constexpr std::size_t kTogether = 32;

// Prefetch distance: random reads of the input are prefetched this number of vertices or cells in
// advance.
constexpr std::int64_t kAhead = 32;

// The welded vertices, sorted along the curve.
Buffer<Vertex> curve_order(std::span<const Point> vertices, std::span<const Vertex> representative,
                           ThreadTeam& team) {
  const std::vector<Vertex> apart = representatives_of(representative);
  if (apart.size() == vertices.size()) return refined_morton_order(vertices, kTogether, team);
  Buffer<Point> positions(apart.size());
  const auto n = std::ssize(apart);
  team.for_each_index(n, [&](std::int64_t i) { positions[i] = vertices[apart[i]]; });
  Buffer<Vertex> order = refined_morton_order(positions.span(), kTogether, team);
  team.for_each_index(n, [&](std::int64_t place) { order[place] = apart[order[place]]; });
  return order;
}

struct SortedVertices {
  Buffer<Point> positions;  // positions of the welded vertices, sorted along the curve
  Buffer<Place> place_of;   // (V,) index of each input vertex in `positions`
};

SortedVertices sort_vertices(std::span<const Point> vertices,
                             std::span<const Vertex> representative, ThreadTeam& team) {
  const Buffer<Vertex> order = curve_order(vertices, representative, team);
  const auto n = std::ssize(order);
  SortedVertices sorted{Buffer<Point>(n), Buffer<Place>(vertices.size())};
  Buffer<Point>& positions = sorted.positions;
  Buffer<Place>& place_of = sorted.place_of;
  team.for_each_index(n, [&](std::int64_t place) {
    if (place + kAhead < n) prefetch(&vertices[order[place + kAhead]]);
    positions[place] = vertices[order[place]];
    place_of[order[place]] = static_cast<Place>(place);
  });
  if (order.size() == vertices.size()) return sorted;
  team.for_each_index(std::ssize(vertices), [&](std::int64_t vertex) {
    if (representative[vertex] != vertex) place_of[vertex] = place_of[representative[vertex]];
  });
  return sorted;
}

// Index at which the lexicographically smallest rotation of a list starts. Time O(n).
std::size_t least_rotation(std::span<const Vertex> list) {
  const std::size_t n = list.size();
  std::size_t best = 0;
  std::size_t other = 1;
  std::size_t n_equal = 0;  // number of equal vertices from both starts on
  while (best < n && other < n && n_equal < n) {
    const Vertex a = list[(best + n_equal) % n];
    const Vertex b = list[(other + n_equal) % n];
    if (a == b) {
      ++n_equal;
      continue;
    }
    (a > b ? best : other) += n_equal + 1;
    if (best == other) ++other;
    n_equal = 0;
  }
  return std::min(best, other);
}

// Renumbers corners, and turns each face so that its lowest vertex comes first. Corners of cells
// that are not faces are sorted.
Buffer<Vertex> renumbered(const CornerLists& cells, const Buffer<Place>& place_of, bool are_faces,
                          ThreadTeam& team) {
  Buffer<Vertex> places(cells.corners.size());
  team.for_each_index(cells.n_cells(), [&](std::int64_t cell) {
    const auto corners = cells[cell];
    const auto list = places.span().subspan(cells.begin_of(cell), corners.size());
    std::ranges::transform(corners, list.begin(), [&](Vertex v) { return place_of[v]; });
    if (are_faces) {
      std::ranges::rotate(list, list.begin() + static_cast<std::ptrdiff_t>(least_rotation(list)));
    } else {
      std::ranges::sort(list);
    }
  });
  return places;
}

// Vertices are split into at most this number of parts, so that the cells of a part are sorted
// within the second-level cache.
constexpr std::int64_t kMaxParts = 1024;

// Sorts cells by their lists of corners, then by cell index. The first corner must be the lowest.
Buffer<Cell> order_of_cells(const CornerLists& cells, std::int64_t n_vertices, ThreadTeam& team) {
  int part_bits = 0;  // the part of a vertex is vertex >> part_bits
  while ((n_vertices >> part_bits) >= kMaxParts) ++part_bits;
  const auto first_of = [&](Cell cell) { return cells[cell].front(); };
  Lists<Cell> parts = group<Cell>(
      cells.n_cells(), (n_vertices >> part_bits) + 1,
      [&](std::int64_t begin, std::int64_t end, const auto& add) {
        for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
          add(first_of(cell) >> part_bits, cell);
        }
      },
      team);
  const auto is_before = [&](Cell a, Cell b) {
    const auto order_of_corners = std::lexicographical_compare_three_way(
        cells[a].begin(), cells[a].end(), cells[b].begin(), cells[b].end());
    return order_of_corners != 0 ? order_of_corners < 0 : a < b;
  };
  team.for_each(parts.n_lists(), [&](std::int64_t part, int) {
    const std::span<const Cell> members = parts[part];
    const auto first = static_cast<Vertex>(part << part_bits);
    const Lists<Cell> by_vertex = group<Cell>(std::int64_t{1} << part_bits, [&](const auto& add) {
      for (const Cell cell : members) add(first_of(cell) - first, cell);
    });
    const auto sorted = parts.entries.span().subspan(parts.offsets[part], members.size());
    std::ranges::copy(by_vertex.entries, sorted.begin());
    for (std::int64_t vertex = 0; vertex < by_vertex.n_lists(); ++vertex) {
      std::ranges::sort(sorted.subspan(by_vertex.offsets[vertex], by_vertex[vertex].size()),
                        is_before);
    }
  });
  return std::move(parts.entries);
}

// Offsets of the sorted cells in their list of corners; empty if the input has no offsets.
Buffer<std::int64_t> sorted_offsets(const CornerLists& cells, std::span<const Cell> order) {
  if (cells.offsets.empty()) return {};
  Buffer<std::int64_t> offsets(cells.offsets.size());
  offsets[0] = 0;
  for (std::size_t place = 0; place < order.size(); ++place) {
    offsets[place + 1] = offsets[place] + std::ssize(cells[order[place]]);
  }
  return offsets;
}

}  // namespace

SortedMesh sort_mesh(std::span<const Point> vertices, std::span<const Vertex> representative,
                     const CornerLists& cells, bool are_faces, ThreadTeam& team) {
  SUPERFACETS_ASSERT(representative.size() == vertices.size());
  SortedVertices by_place = sort_vertices(vertices, representative, team);
  const Buffer<Vertex> places = renumbered(cells, by_place.place_of, are_faces, team);
  const CornerLists placed{places.span(), cells.offsets, cells.size};
  Buffer<Cell> order = order_of_cells(placed, std::ssize(by_place.positions), team);
  SortedMesh sorted{std::move(by_place.positions),
                    Buffer<Vertex>(places.size()),
                    {},
                    std::move(order),
                    std::move(by_place.place_of)};
  sorted.offsets = sorted_offsets(placed, sorted.order.span());
  const CornerLists rows{{}, sorted.offsets.span(), cells.size};
  const auto n_cells = std::ssize(sorted.order);
  team.for_each_index(n_cells, [&](std::int64_t place) {
    if (place + kAhead < n_cells) {
      prefetch(places.data() + placed.begin_of(sorted.order[place + kAhead]));
    }
    const auto corners = placed[sorted.order[place]];
    std::ranges::copy(corners, sorted.corners.data() + rows.begin_of(place));
  });
  return sorted;
}

}  // namespace superfacets
