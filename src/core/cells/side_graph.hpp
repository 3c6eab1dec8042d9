// Stage 1: the graph of cells that share a side. Builds the graph for any cells whose sides are
// sets of vertices. For triangles, triangle_graph.hpp is faster.
#pragma once

#include <tuple>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// The maximum number of arcs is 2^24 or 16 per face, whichever is larger. This limit accepts any
// ordinary large mesh, and rejects a mesh with very many faces on most edges.
inline constexpr std::int64_t kArcsAlwaysAllowed = std::int64_t{1} << 24;
inline constexpr std::int64_t kArcsPerFaceAllowed = 16;

// On a side with at most this number of cells, all pairs of cells are neighbors. Otherwise arcs
// would grow with the square of the number of cells; see for_each_linked.
inline constexpr std::int64_t kMostPaired = 64;

// Calls visit(i) for the neighbors of a cell among the n cells on a side, in any order. Cells on a
// side have the numbers 0 to n - 1, in ascending order of their indices. If n is above kMostPaired,
// the numbers of neighbors differ by a power of two, where n - 1 is followed by 0. So each pair of
// cells is joined by a path of fewer than log2(n) arcs.
template <typename Visit>
void for_each_linked(std::int64_t n, std::int64_t own, const Visit& visit) {
  for (std::int64_t step = 1; step < n && n <= kMostPaired; ++step) visit((own + step) % n);
  for (std::int64_t step = 1; 2 * step < n && n > kMostPaired; step *= 2) {
    visit((own + step) % n);
    visit((own + n - step) % n);
  }
}

// Number of neighbors that each of n cells on a side has across this side.
inline std::int64_t count_linked(std::int64_t n) {
  std::int64_t n_linked = 0;
  for_each_linked(n, 0, [&](std::int64_t) { ++n_linked; });
  return n_linked;
}

// Number of edges of each type.
struct EdgeCounts {
  std::int64_t edges = 0;
  std::int64_t boundary = 0;      // number of edges with one face
  std::int64_t non_manifold = 0;  // number of edges with at least three faces
  // Number of edges whose two faces traverse them in the same direction.
  std::int64_t inconsistent = 0;
};

// Numbers of edges and arcs of a mesh.
struct EdgeTally {
  EdgeCounts edges;
  // Sum of n count_linked(n) over edges with n faces.
  std::uint64_t arcs = 0;
  std::int64_t most_faces = 0;  // maximum number of faces on one edge

  void add(const EdgeTally& other);
  // Adds an edge with n_faces faces.
  void count(std::size_t n_faces, bool is_inconsistent);
};

// Throws std::length_error if there are too many arcs for a mesh with n_faces faces.
void check_number_of_arcs(const EdgeTally& tally, std::int64_t n_faces);

// Graph of cells that share a side: faces that share an edge, or tetrahedra that share a triangle.
// `Side` is the integer type of side numbers.
template <typename Side>
struct SideGraph {
  Buffer<std::int64_t> offsets;    // (N + 1,) arcs of cell i: offsets[i] .. offsets[i+1]-1
  Buffer<Cell> neighbors;          // (M,) target cell of each arc
  Buffer<Side> sides;              // (M,) side of the cell that each arc crosses
  Buffer<std::uint8_t> same_turn;  // (M,) 1 if both cells traverse the side in the same direction
  EdgeCounts counts;
};

// Sort key of a side: its vertices, except the lowest, packed into one number.
using SideKey = std::uint64_t;

// One side of one cell, listed at the lowest of its vertices.
struct ListedSide {
  SideKey key;
  Cell cell;
  std::int32_t side;
  bool ascending;  // direction of traversal; consistently oriented neighbors differ
};

// The sides of all cells, grouped by their lowest vertex, and sorted by key, cell and side.
struct SideList {
  Buffer<std::int64_t> starts;  // (V + 1,) start of each vertex in `sides`
  Buffer<ListedSide> sides;
};

// For each side of each cell, the range of the sorted side list that contains all cells on this
// side.
struct SharedSides {
  Buffer<std::int64_t> firsts;  // start of the range of each side
  Buffer<std::int32_t> sizes;   // number of cells on each side; 0 if the side is dropped
};

// Lists and sorts the sides of all cells. `cells` provides n_cells() and n_vertices().
// first_place(cell) is the index of the first side of a cell among all sides;
// first_place(n_cells()) is the number of sides. for_each_side(cell, visit) calls visit(side,
// lowest vertex, key, ascending).
template <typename Cells>
SideList list_sides(const Cells& cells, ThreadTeam& team) {
  Buffer<std::int64_t> ends(cells.n_vertices() +
                            // Number of sides per vertex, later write cursors, finally the ends of
                            // the lists.
                            1);
  team.fill(ends.span(), std::int64_t{0});
  const auto for_all = [&](const auto& visit) {
    team.for_each_index(cells.n_cells(), [&](Cell cell) {
      cells.for_each_side(cell, [&](std::int32_t side, Vertex low, SideKey key, bool ascending) {
        const std::int64_t place =
            std::atomic_ref(ends[low]).fetch_add(1, std::memory_order_relaxed);
        visit(place, ListedSide{key, cell, side, ascending});
      });
    });
  };
  for_all([](std::int64_t, const ListedSide&) {});
  SideList list{Buffer<std::int64_t>(cells.n_vertices() + 1), {}};
  std::int64_t total = 0;
  for (std::int64_t vertex = 0; vertex <= cells.n_vertices(); ++vertex) {
    list.starts[vertex] = total;
    total += std::exchange(ends[vertex], total);
  }
  list.sides = Buffer<ListedSide>(total);
  for_all([&](std::int64_t place, const ListedSide& side) { list.sides[place] = side; });
  // Threads write in any order. Sorting makes the result deterministic.
  team.for_each_index(cells.n_vertices(), [&](std::int64_t vertex) {
    const std::int64_t begin = list.starts[vertex];
    std::ranges::sort(
        list.sides.span().subspan(begin, list.starts[vertex + 1] - begin), {},
        [](const ListedSide& side) { return std::tuple(side.key, side.cell, side.side); });
  });
  return list;
}

// Finds the cells on each side with the given lowest vertex, from the sorted list of sides. If a
// cell has several sides with the same vertices, only the first of these sides is kept.
template <typename Cells>
void share_sides_at(const Cells& cells, SideList& list, Vertex vertex, SharedSides& shared,
                    EdgeTally& tally) {
  const std::int64_t end = list.starts[vertex + 1];
  for (std::int64_t i = list.starts[vertex]; i < end;) {
    const std::int64_t first = i;
    const SideKey key = list.sides[i].key;
    std::int64_t kept = i;
    for (; i < end && list.sides[i].key == key; ++i) {
      const ListedSide side = list.sides[i];
      if (kept == first || list.sides[kept - 1].cell != side.cell) list.sides[kept++] = side;
    }
    const auto on_side = list.sides.span().subspan(first, kept - first);
    const std::size_t n = on_side.size();
    tally.count(n, n == 2 && on_side[0].ascending == on_side[1].ascending);
    for (const ListedSide& side : on_side) {
      const std::int64_t place = cells.first_place(side.cell) + side.side;
      shared.firsts[place] = first;
      shared.sizes[place] = static_cast<std::int32_t>(on_side.size());
    }
  }
}

template <typename Cells>
EdgeTally share_sides(const Cells& cells, SideList& list, ThreadTeam& team, SharedSides& shared) {
  team.fill(shared.sizes.span(), 0);
  EdgeTally total;
  std::mutex mutex;  // protects `total`
  team.for_each_block(cells.n_vertices(), [&](std::int64_t begin, std::int64_t end) {
    EdgeTally tally;
    for (auto vertex = static_cast<Vertex>(begin); vertex < end; ++vertex) {
      share_sides_at(cells, list, vertex, shared, tally);
    }
    const std::scoped_lock lock(mutex);
    total.add(tally);
  });
  return total;
}

// Writes the arcs of a cell, beginning at graph.offsets[cell].
template <typename Cells>
void write_arcs(const Cells& cells, const SideList& list, const SharedSides& shared, Cell cell,
                SideGraph<std::int32_t>& graph) {
  std::int64_t arc = graph.offsets[cell];
  for (std::int64_t place = cells.first_place(cell); place < cells.first_place(cell + 1); ++place) {
    if (shared.sizes[place] == 0) continue;
    const auto on_side = list.sides.span().subspan(shared.firsts[place], shared.sizes[place]);
    const auto own = std::ranges::lower_bound(on_side, cell, {}, &ListedSide::cell);
    const std::int64_t first = arc;
    for_each_linked(std::ssize(on_side), own - on_side.begin(),
                    [&](std::int64_t i) { graph.neighbors[arc++] = on_side[i].cell; });
    std::sort(graph.neighbors.data() + first, graph.neighbors.data() + arc);
    for (std::int64_t i = first; i < arc; ++i) {
      const auto other =
          std::ranges::lower_bound(on_side, graph.neighbors[i], {}, &ListedSide::cell);
      graph.sides[i] = own->side;
      graph.same_turn[i] = static_cast<std::uint8_t>(other->ascending == own->ascending);
    }
  }
  SUPERFACETS_ASSERT(arc == graph.offsets[cell + 1]);
}

// Builds one arc per shared side and direction, sorted by side, then by neighbor. All pairs of
// cells on a side are neighbors, except on a side with more than kMostPaired cells. No cell is its
// own neighbor. Throws std::length_error before it allocates arcs, if there are too many arcs (see
// check_number_of_arcs).
template <typename Cells>
SideGraph<std::int32_t> build_side_graph(const Cells& cells, ThreadTeam& team) {
  const std::int64_t n_cells = cells.n_cells();
  SideList list = list_sides(cells, team);
  const auto n_places = static_cast<std::size_t>(cells.first_place(cells.n_cells()));
  SharedSides shared{Buffer<std::int64_t>(n_places), Buffer<std::int32_t>(n_places)};
  const EdgeTally tally = share_sides(cells, list, team, shared);
  check_number_of_arcs(tally, n_cells);
  SideGraph<std::int32_t> graph;
  graph.counts = tally.edges;
  graph.offsets = Buffer<std::int64_t>(n_cells + 1);
  std::int64_t total = 0;
  for (Cell cell = 0; cell < n_cells; ++cell) {
    graph.offsets[cell] = total;
    for (std::int64_t place = cells.first_place(cell); place < cells.first_place(cell + 1);
         ++place) {
      total += count_linked(shared.sizes[place]);
    }
  }
  graph.offsets[n_cells] = total;
  graph.neighbors = Buffer<Cell>(total);
  graph.sides = Buffer<std::int32_t>(total);
  graph.same_turn = Buffer<std::uint8_t>(total);
  team.for_each_index(n_cells, [&](Cell cell) { write_arcs(cells, list, shared, cell, graph); });
  return graph;
}

}  // namespace superfacets
