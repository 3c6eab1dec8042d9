#include "spatial/sorted_mesh.hpp"

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

// Returns the cells sorted along the curve by the mean of their corners, then by their corners,
// then by cell index.
Buffer<Cell> order_of_cells(const CornerLists& cells, std::span<const Point> vertices,
                            ThreadTeam& team) {
  const auto center_of = [&](std::int64_t cell) {
    const auto corners = cells[cell];
    Point sum{0.0, 0.0, 0.0};
    for (const Vertex corner : corners) sum = sum + vertices[corner];
    const auto n = static_cast<double>(corners.size());
    return Point{sum.x / n, sum.y / n, sum.z / n};
  };
  const Curve curve(bounds_of(cells.n_cells(), center_of, team));
  Buffer<std::uint32_t> codes(cells.n_cells());
  team.for_each_index(cells.n_cells(),
                      [&](Cell cell) { codes[cell] = curve.code_of(center_of(cell)); });
  SortedCodes sorted = sorted_codes(std::move(codes), team);
  const auto is_before = [&](Cell a, Cell b) {
    const auto order_of_corners = std::lexicographical_compare_three_way(
        cells[a].begin(), cells[a].end(), cells[b].begin(), cells[b].end());
    return order_of_corners != 0 ? order_of_corners < 0 : a < b;
  };
  for_each_run(sorted, [&](std::span<Cell> run) { std::ranges::sort(run, is_before); }, team);
  return std::move(sorted.order);
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
  Buffer<Cell> order = order_of_cells(placed, by_place.positions.span(), team);
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
