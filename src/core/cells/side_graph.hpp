// Stage 1: the graph of cells that share a side, for any cells whose sides are sets of vertices.
#pragma once

#include <array>

#include "base/lists.hpp"

namespace superfacets {

// The maximum number of arcs is 2^24 or 16 per face, whichever is larger. This limit accepts any
// ordinary large mesh, and rejects a mesh with very many faces on most edges.
inline constexpr std::int64_t kArcsAlwaysAllowed = std::int64_t{1} << 24;
inline constexpr std::int64_t kArcsPerFaceAllowed = 16;

// On a side with at most this number of cells, all pairs of cells are neighbors. On larger
// sides, all pairs would need too many arcs; for_each_linked chooses the neighbors.
inline constexpr std::int64_t kMostPaired = 64;

// Calls visit(i) for the neighbors of a cell among the n cells on a side, in any order. Cells on a
// side have the numbers 0 to n - 1, in ascending order of their indices. If n is above kMostPaired,
// the numbers of neighbors differ by a power of two modulo n, so each pair of cells is joined by a
// path of fewer than log2(n) arcs.
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

  void add(const EdgeTally& other) {
    edges.edges += other.edges.edges;
    edges.boundary += other.edges.boundary;
    edges.non_manifold += other.edges.non_manifold;
    edges.inconsistent += other.edges.inconsistent;
    arcs += other.arcs;
    most_faces = std::max(most_faces, other.most_faces);
  }
  // Adds an edge with n_faces faces.
  void count(std::size_t n_faces, bool is_inconsistent);
};

// Throws std::length_error if there are too many arcs for a mesh with n_faces faces.
void check_number_of_arcs(const EdgeTally& tally, std::int64_t n_faces);

// Graph of cells that share a side: faces that share an edge, or tetrahedra that share a triangle.
// `Side` is the integer type of side numbers.
template <typename Side>
struct SideGraph {
  Buffer<std::int64_t> offsets;  // (N + 1,) arcs of cell i: offsets[i] .. offsets[i+1]-1
  Buffer<Cell> neighbors;        // (M,) target cell of each arc
  Buffer<Side> sides;            // (M,) side of the cell that each arc crosses
  // (M,) 1 if both cells traverse the side in the same direction; empty if all values are 0
  Buffer<std::uint8_t> same_turn;
  EdgeCounts counts;
};

// Vertices are split into parts of at least 2^kMinPartBits vertices, so that the sides of a part
// are matched within the second-level cache. The number of parts is limited, because a processor
// core writes efficiently to only a limited number of streams.
inline constexpr int kMinPartBits = 11;
inline constexpr std::int64_t kMaxParts = 1024;

// Number of cells per parallel task that counts or writes arcs.
inline constexpr std::int64_t kCellsPerTask = 1 << 14;

// Replaces welded vertices by their representative. If no vertices are welded, as in most meshes,
// this needs no memory access.
class Welding {
 public:
  explicit Welding(std::span<const Vertex> representative) : representative_(representative) {
    for (Vertex v = 0; v < n_vertices() && !has_welded_; ++v) has_welded_ = representative[v] != v;
  }

  std::int64_t n_vertices() const { return std::ssize(representative_); }
  Vertex operator[](Vertex vertex) const { return has_welded_ ? representative_[vertex] : vertex; }

 private:
  std::span<const Vertex> representative_;
  bool has_welded_ = false;
};

// One side of one cell. Its vertices are not stored, because its position in the lists implies
// them.
class CellSide {
 public:
  CellSide() = default;
  CellSide(Cell cell, std::int32_t side, bool is_ascending)
      : cell_(cell), bits_(static_cast<std::uint32_t>(side) << 1U | std::uint32_t{is_ascending}) {}

  Cell cell() const { return cell_; }
  std::int32_t side() const { return static_cast<std::int32_t>(bits_ >> 1U); }
  // Direction in which the cell traverses the side; consistently oriented neighbors differ.
  bool is_ascending() const { return (bits_ & 1U) != 0; }

 private:
  Cell cell_ = kNoCell;
  std::uint32_t bits_ = 0;
};

// How many other cells share a side of a cell. For a single other cell, also the direction in which
// that cell traverses the side.
enum Link : std::uint8_t {
  // The first two values are those of SideGraph::same_turn.
  kOpposed,  // one other cell, which traverses the side in the opposite direction
  kAlike,    // one other cell, which traverses the side in the same direction
  kNone,     // no other cell: a side at the boundary, or a side that is dropped
  kCrowd,    // at least two other cells
};

// Groups of at least three sides that have the same vertices and belong to different cells, in
// ascending order of these cells.
class Crowds {
 public:
  std::int64_t size() const { return std::ssize(starts_) - 1; }
  std::span<const CellSide> operator[](std::int64_t crowd) const {
    return std::span(sides_).subspan(starts_[crowd], starts_[crowd + 1] - starts_[crowd]);
  }
  void add(std::span<const CellSide> sides) {
    sides_.insert(sides_.end(), sides.begin(), sides.end());
    starts_.push_back(std::ssize(sides_));
  }

 private:
  std::vector<CellSide> sides_;
  std::vector<std::int64_t> starts_{0};
};

// The cells on the other side of each cell's sides. Sides of all cells are numbered in order.
struct SideLinks {
  Buffer<std::uint8_t> kinds;  // (S,) values of Link
  // (S,) the other cell if the link is kOpposed or kAlike, an index in `crowds` if it is kCrowd
  Buffer<Cell> others;
  Crowds crowds;  // their order depends on the threads
};

// The sides whose lowest vertex is in a given range of vertices, grouped by lowest vertex.
template <typename Cells>
class SidesOfPart {
 public:
  using Key = typename Cells::Key;

  // Number of sides of a vertex for which there are slots. On triangles, the mean is six sides.
  static constexpr std::size_t kSlots = 16;

  // Lists the sides of the given cells whose lowest vertex is in the given part.
  void list(const Cells& cells, std::span<const Cell> members, int part_bits, std::int64_t part) {
    const std::uint32_t n_vertices = std::uint32_t{1} << part_bits;
    const auto first = static_cast<Vertex>(part << part_bits);
    if (sizes_.size() != n_vertices) {
      sizes_.resize(n_vertices);
      keys_ = Buffer<Key>(n_vertices * kSlots);
      std::ranges::fill(keys_, Key{0});
      sides_ = Buffer<CellSide>(n_vertices * kSlots);
    }
    std::ranges::fill(sizes_, 0);
    rest_.clear();
    std::uint32_t* const sizes = sizes_.data();
    Key* const keys = keys_.data();
    CellSide* const sides = sides_.data();
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (i + kAhead < members.size()) cells.prefetch(members[i + kAhead]);
      const Cell cell = members[i];
      cells.for_each_side(cell, [&](std::int32_t side, Vertex low, Key key, bool is_ascending) {
        const auto vertex = static_cast<std::uint32_t>(low - first);
        if (vertex >= n_vertices) return;
        const std::size_t n = sizes[vertex]++;
        const CellSide listed(cell, side, is_ascending);
        if (n >= kSlots) return rest_.push_back({vertex, key, listed});
        keys[vertex * kSlots + n] = key;
        sides[vertex * kSlots + n] = listed;
      });
    }
    std::ranges::stable_sort(rest_, {}, &Listed::vertex);
  }

  std::size_t n_vertices() const { return sizes_.size(); }
  std::size_t size(std::size_t vertex) const { return sizes_[vertex]; }

  // The first kSlots sides of a vertex, and their keys. Slots that are not used have any values.
  const CellSide* sides(std::size_t vertex) const { return sides_.data() + vertex * kSlots; }
  const Key* keys(std::size_t vertex) const { return keys_.data() + vertex * kSlots; }

  // Calls visit(key, side) for all sides of a vertex, in the order of their cells.
  template <typename Visit>
  void for_each(std::size_t vertex, const Visit& visit) const {
    for (std::size_t i = 0; i < std::min(kSlots, size(vertex)); ++i) {
      visit(keys(vertex)[i], sides(vertex)[i]);
    }
    for (const Listed& other : std::ranges::equal_range(rest_, vertex, {}, &Listed::vertex)) {
      visit(other.key, other.side);
    }
  }

 private:
  // Prefetch distance: the corners of a cell are prefetched this number of cells in advance.
  static constexpr std::size_t kAhead = 16;

  struct Listed {
    std::size_t vertex;
    Key key;
    CellSide side;
  };

  std::vector<std::uint32_t> sizes_;  // number of sides of each vertex
  Buffer<Key> keys_;
  Buffer<CellSide> sides_;
  std::vector<Listed> rest_;  // sides for which there was no slot, sorted by vertex
};

// For each of n <= kMost sides with the same lowest vertex, the number of sides with the same key,
// and the sum of the indices of these sides. Vector instructions compare all pairs, without
// branches or sorting.
template <typename Key, std::size_t kMost>
class Matches {
 public:
  // Reads kMost keys, and ignores all keys after the first n.
  Matches(const Key* keys, std::size_t n) {
    for (std::size_t j = 0; j < n; ++j) {
      const Key key = keys[j];
      const std::uint32_t one = kOne + static_cast<std::uint32_t>(j);
      for (std::size_t i = 0; i < kMost; ++i) found_[i] += keys[i] == key ? one : 0;
    }
  }

  bool is_alone(std::size_t i) const { return found_[i] < 2 * kOne; }
  bool is_paired(std::size_t i) const { return found_[i] / kOne == 2; }
  // The other side with the same key if a side is paired, and otherwise the side itself.
  std::size_t other(std::size_t i) const { return is_paired(i) ? found_[i] % kOne - i : i; }

 private:
  static constexpr std::uint32_t kOne = 1U << 16U;

  std::array<std::uint32_t, kMost> found_{};  // kOne times the number, plus the sum
};

// Links the sides that have the same vertices, for one part of the vertices after another.
template <typename Cells>
class Linker {
 public:
  Linker(const Cells& cells, SideLinks& links) : cells_(cells), links_(links) {}

  const EdgeTally& tally() const { return tally_; }
  const Crowds& crowds() const { return crowds_; }

  // Links all sides of the given cells whose lowest vertex is in the given part.
  void link_part(std::span<const Cell> members, int part_bits, std::int64_t part) {
    sides_.list(cells_, members, part_bits, part);
    for (std::size_t vertex = 0; vertex < sides_.n_vertices(); ++vertex) {
      const std::size_t n = sides_.size(vertex);
      const bool is_done = n <= kFew ? link_pairs<kFew>(vertex, n) : link_pairs<kMany>(vertex, n);
      if (!is_done) link_groups(vertex);
    }
  }

 private:
  using Key = typename Cells::Key;

  // The faster version of link_pairs is used for vertices of at most kFew sides.
  static constexpr std::size_t kFew = 8;
  static constexpr std::size_t kMany = SidesOfPart<Cells>::kSlots;

  void set(CellSide side, Link link, Cell other) {
    const std::int64_t place = cells_.first_place(side.cell()) + side.side();
    links_.kinds[place] = link;
    links_.others[place] = other;
  }

  static Link pair_link(CellSide a, CellSide b) {
    return a.is_ascending() == b.is_ascending() ? kAlike : kOpposed;
  }

  // Tries to link the n sides of a vertex. Returns false, after writing any links, if there are
  // more than kMost sides, or if a group has two sides of one cell or more than two sides.
  template <std::size_t kMost>
  bool link_pairs(std::size_t vertex, std::size_t n) {
    if (n > kMost) return false;
    const CellSide* const sides = sides_.sides(vertex);
    const Matches<Key, kMost> matches(sides_.keys(vertex), n);
    bool is_simple = true;
    std::int64_t n_paired = 0;
    std::int64_t n_alike = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const CellSide other = sides[matches.other(i)];
      const bool is_paired = other.cell() != sides[i].cell();
      is_simple &= is_paired || matches.is_alone(i);
      const Link link = is_paired ? pair_link(sides[i], other) : kNone;
      set(sides[i], link, other.cell());
      n_paired += static_cast<std::int64_t>(is_paired);
      n_alike += static_cast<std::int64_t>(link == kAlike);
    }
    if (!is_simple) return false;
    const auto n_alone = static_cast<std::int64_t>(n) - n_paired;
    tally_.add({{n_alone + n_paired / 2, n_alone, 0, n_alike / 2},
                static_cast<std::uint64_t>(n_paired),
                n_paired > 0 ? 2 : std::int64_t{n_alone > 0}});
    return true;
  }

  // Links any number of sides of a vertex, after sorting them by key.
  void link_groups(std::size_t vertex) {
    order_.clear();
    listed_.clear();
    sides_.for_each(vertex, [&](Key key, CellSide side) {
      set(side, kNone, kNoCell);
      order_.emplace_back(key, listed_.size());
      listed_.push_back(side);
    });
    std::ranges::sort(order_);
    for (std::size_t i = 0; i < order_.size();) {
      const Key key = order_[i].first;
      group_.clear();
      for (; i < order_.size() && order_[i].first == key; ++i) {
        const CellSide side = listed_[order_[i].second];
        // A degenerate cell may have several sides in one group. Only the first is kept, so that no
        // cell is its own neighbor.
        if (group_.empty() || group_.back().cell() != side.cell()) group_.push_back(side);
      }
      link_group(group_);
    }
  }

  // Links the sides of a group, which belong to different cells in ascending order.
  void link_group(std::span<const CellSide> sides) {
    const Link link = sides.size() == 2 ? pair_link(sides[0], sides[1]) : kCrowd;
    tally_.count(sides.size(), link == kAlike);
    if (sides.size() == 1) return;
    if (link == kCrowd) return crowds_.add(sides);
    set(sides[0], link, sides[1].cell());
    set(sides[1], link, sides[0].cell());
  }

  const Cells& cells_;
  SideLinks& links_;
  SidesOfPart<Cells> sides_;
  std::vector<std::pair<Key, std::size_t>> order_;
  std::vector<CellSide> listed_;
  std::vector<CellSide> group_;
  Crowds crowds_;
  EdgeTally tally_;  // numbers of sides and arcs, summed over all parts
};

// Links the sides of all cells.
template <typename Cells>
EdgeTally link_sides(const Cells& cells, ThreadTeam& team, SideLinks& links) {
  team.fill(links.kinds.span(), std::uint8_t{kNone});
  int part_bits = kMinPartBits;  // the part of a vertex is vertex >> part_bits
  while ((cells.n_vertices() >> part_bits) >= kMaxParts) ++part_bits;
  const std::int64_t n_parts = (cells.n_vertices() >> part_bits) + 1;
  // cells grouped by the parts of the lowest vertices of their sides
  const Lists<Cell> parts = group<Cell>(
      cells.n_cells(), n_parts,
      [&](std::int64_t begin, std::int64_t end, const auto& add) {
        std::vector<Cell> last(n_parts, kNoCell);  // the last cell that was added to each part
        for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
          cells.for_each_side(cell, [&](std::int32_t, Vertex low, auto, bool) {
            const Vertex part = low >> part_bits;
            if (std::exchange(last[part], cell) != cell) add(part, cell);
          });
        }
      },
      team);
  std::vector<Linker<Cells>> linkers;
  linkers.reserve(team.size());
  for (int thread = 0; thread < team.size(); ++thread) linkers.emplace_back(cells, links);
  team.for_each(n_parts, [&](std::int64_t part, int thread) {
    linkers[thread].link_part(parts[part], part_bits, part);
  });
  EdgeTally total;
  for (const Linker<Cells>& linker : linkers) {
    total.add(linker.tally());
    for (std::int64_t i = 0; i < linker.crowds().size(); ++i) {
      for (const CellSide side : linker.crowds()[i]) {
        const std::int64_t place = cells.first_place(side.cell()) + side.side();
        links.kinds[place] = kCrowd;
        links.others[place] = static_cast<Cell>(links.crowds.size());
      }
      links.crowds.add(linker.crowds()[i]);
    }
  }
  return total;
}

// Writes the arcs of cells begin .. end-1, beginning at graph.offsets[begin].
template <typename Cells, typename Side>
void write_arcs(const Cells& cells, const SideLinks& links, std::int64_t begin, std::int64_t end,
                SideGraph<Side>& graph) {
  std::int64_t arc = graph.offsets[begin];
  const auto write = [&arc, neighbors = graph.neighbors.data(), sides = graph.sides.data(),
                      turns = graph.same_turn.data()](Cell neighbor, auto side, bool same_turn) {
    neighbors[arc] = neighbor;
    sides[arc] = static_cast<Side>(side);
    if (turns != nullptr) turns[arc] = static_cast<std::uint8_t>(same_turn);
    ++arc;
  };
  std::vector<CellSide> found;
  for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
    graph.offsets[cell] = arc;
    const std::int64_t first = cells.first_place(cell);
    const std::int64_t n_sides = cells.first_place(cell + 1) - first;
    const std::uint8_t* const kinds = links.kinds.data() + first;
    for (std::int64_t side = 0; side < n_sides; ++side) {
      if (kinds[side] == kNone) continue;
      if (kinds[side] != kCrowd) {
        write(links.others[first + side], side, kinds[side] == kAlike);
        continue;
      }
      const auto crowd = links.crowds[links.others[first + side]];
      const auto own = std::ranges::lower_bound(crowd, cell, {}, &CellSide::cell);
      found.clear();
      for_each_linked(std::ssize(crowd), own - crowd.begin(),
                      [&](std::int64_t i) { found.push_back(crowd[i]); });
      std::ranges::sort(found, {}, &CellSide::cell);
      for (const CellSide other : found) {
        write(other.cell(), side, other.is_ascending() == own->is_ascending());
      }
    }
  }
}

// Number of arcs that cross the sides begin .. end-1.
inline std::int64_t count_arcs(const SideLinks& links, std::int64_t begin, std::int64_t end) {
  std::int64_t n_arcs = 0;
  for (std::int64_t place = begin; place < end; ++place) {
    n_arcs += links.kinds[place] == kCrowd
                  ? count_linked(std::ssize(links.crowds[links.others[place]]))
                  : std::int64_t{links.kinds[place] != kNone};
  }
  return n_arcs;
}

// Moves the links into the graph. Requires exactly one arc per side, because the links then equal
// the arcs.
template <typename Cells, typename Side>
void take_links(const Cells& cells, SideLinks&& links, ThreadTeam& team, SideGraph<Side>& graph) {
  graph.sides = Buffer<Side>(links.kinds.size());
  graph.neighbors = std::move(links.others);
  if (graph.counts.inconsistent > 0) graph.same_turn = std::move(links.kinds);
  team.for_each_index(std::int64_t{cells.n_cells()} + 1, [&](std::int64_t cell) {
    graph.offsets[cell] = cells.first_place(cell);
    if (cell == cells.n_cells()) return;
    for (std::int64_t place = cells.first_place(cell); place < cells.first_place(cell + 1);
         ++place) {
      graph.sides[place] = static_cast<Side>(place - cells.first_place(cell));
    }
  });
}

template <typename Cells, typename Side>
void collect_arcs(const Cells& cells, const SideLinks& links, ThreadTeam& team,
                  SideGraph<Side>& graph) {
  const std::int64_t n_cells = cells.n_cells();
  team.for_each_block(
      n_cells,
      [&](std::int64_t begin, std::int64_t end) {
        graph.offsets[begin] = count_arcs(links, cells.first_place(begin), cells.first_place(end));
      },
      kCellsPerTask);
  std::int64_t total = 0;
  for (std::int64_t begin = 0; begin < n_cells; begin += kCellsPerTask) {
    total += std::exchange(graph.offsets[begin], total);
  }
  graph.offsets[n_cells] = total;
  graph.neighbors = Buffer<Cell>(total);
  graph.sides = Buffer<Side>(total);
  if (graph.counts.inconsistent > 0 || links.crowds.size() > 0) {
    graph.same_turn = Buffer<std::uint8_t>(total);
  }
  team.for_each_block(
      n_cells,
      [&](std::int64_t begin, std::int64_t end) { write_arcs(cells, links, begin, end, graph); },
      kCellsPerTask);
}

// Builds one arc per shared side and direction, sorted by side, then by neighbor. All pairs of
// cells on a side are neighbors, except on a side with more than kMostPaired cells. No cell is its
// own neighbor: of several sides of one cell with the same vertices, only the first is used. Throws
// std::length_error before it allocates arcs, if there are too many arcs (see
// check_number_of_arcs).
//
// `cells` provides n_cells(), n_vertices() and prefetch(cell). first_place(cell) is the index of
// the first side of a cell among all sides; first_place(n_cells()) is the number of sides.
// for_each_side(cell, visit) calls visit(side, lowest vertex, key, is_ascending), where the key, of
// the type Cells::Key, contains all vertices of the side except the lowest.
template <typename Side, typename Cells>
SideGraph<Side> build_side_graph(const Cells& cells, ThreadTeam& team) {
  const std::int64_t n_cells = cells.n_cells();
  const std::int64_t n_sides = cells.first_place(n_cells);
  SideLinks links{Buffer<std::uint8_t>(n_sides), Buffer<Cell>(n_sides), {}};
  const EdgeTally tally = link_sides(cells, team, links);
  check_number_of_arcs(tally, n_cells);
  SideGraph<Side> graph;
  graph.counts = tally.edges;
  graph.offsets = Buffer<std::int64_t>(n_cells + 1);
  if (links.crowds.size() == 0 && std::cmp_equal(tally.arcs, n_sides)) {
    take_links(cells, std::move(links), team, graph);
  } else {
    collect_arcs(cells, links, team, graph);
  }
  return graph;
}

}  // namespace superfacets
