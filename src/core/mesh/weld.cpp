#include "mesh/weld.hpp"

#include <array>
#include <bit>
#include <limits>

#include "base/prefetch.hpp"

namespace superfacets {
namespace {

constexpr Vertex kEmptySlot = -1;

// Prefetch distance, in vertices. The distance is large enough to hide the latency of memory, and
// small enough for the hash slots to stay in the first-level cache.
constexpr std::int64_t kBatch = 32;

// The finalizer of splitmix64: every output bit depends on every input bit, so regular grids of
// positions do not cluster in the table.
std::uint64_t mix(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9ULL;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebULL;
  return bits ^ (bits >> 31);
}

// Hashes a position. A multiplication moves the bits of a coordinate to the upper half of the
// product. The products are rotated by different amounts and added, so that one finalizer mixes all
// coordinates.
std::uint64_t hash(Point p) {
  // Adding 0.0 turns -0.0 into 0.0. The two zeros compare equal, so they must have the same hash.
  SUPERFACETS_ASSERT(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  const std::uint64_t x = std::bit_cast<std::uint64_t>(p.x + 0.0) * 0x9e3779b97f4a7c15ULL;
  const std::uint64_t y = std::bit_cast<std::uint64_t>(p.y + 0.0) * 0xd6e8feb86659fd93ULL;
  const std::uint64_t z = std::bit_cast<std::uint64_t>(p.z + 0.0) * 0xa0761d6478bd642fULL;
  return mix(x + std::rotl(y, 22) + std::rotl(z, 43));
}

// Hash table from positions to the vertex of lowest index at each position, with open addressing
// and linear probing, at most half full. An occupied slot never changes its position, and all
// threads probe in the same order. So threads agree on one slot per position without a lock.
class PositionTable {
 public:
  using Slot =
      std::uint32_t;  // 32 bits suffice, because 2^31 - 1 vertices need a table of 2^32 slots

  PositionTable(std::span<const Point> vertices, ThreadTeam& team)
      : vertices_(vertices), table_(std::bit_ceil(2 * vertices.size() + 1)) {
    team.fill(table_.span(), kEmptySlot);
  }

  // Returns the hash slot of the vertex's position. Stores `vertex` in the slot if the slot is
  // empty or contains a vertex of higher index. Sets is_shared if another vertex with this position
  // is in the slot.
  Slot insert(Vertex vertex, Slot home, bool& is_shared) {
    for (Slot slot = home;; slot = next(slot)) {
      const std::atomic_ref<Vertex> owner(table_[slot]);
      Vertex seen = owner.load(std::memory_order_relaxed);
      if (seen == kEmptySlot &&
          owner.compare_exchange_strong(seen, vertex, std::memory_order_relaxed)) {
        return slot;
      }
      if (vertices_[seen] != vertices_[vertex]) continue;
      is_shared = true;
      while (vertex < seen &&
             !owner.compare_exchange_weak(seen, vertex, std::memory_order_relaxed)) {
      }
      return slot;
    }
  }

  Slot home(Vertex vertex) const { return static_cast<Slot>(hash(vertices_[vertex])) & mask(); }
  const Vertex& operator[](Slot slot) const { return table_[slot]; }

 private:
  Slot mask() const { return static_cast<Slot>(table_.size() - 1); }
  Slot next(Slot slot) const { return (slot + 1) & mask(); }

  std::span<const Point> vertices_;
  Buffer<Vertex> table_;
};

// Inserts vertices begin .. end-1. Returns whether the position of any of these vertices was
// already in the table.
bool insert_range(std::int64_t begin, std::int64_t end, PositionTable& table,
                  std::span<PositionTable::Slot> slots) {
  bool is_shared = false;
  std::array<PositionTable::Slot, kBatch> homes;
  for (std::int64_t first = begin; first < end; first += kBatch) {
    const std::int64_t size = std::min(kBatch, end - first);
    for (std::int64_t i = 0; i < size; ++i) {
      homes[i] = table.home(static_cast<Vertex>(first + i));
      prefetch(&table[homes[i]]);
    }
    for (std::int64_t i = 0; i < size; ++i) {
      slots[first + i] = table.insert(static_cast<Vertex>(first + i), homes[i], is_shared);
    }
  }
  return is_shared;
}

}  // namespace

Buffer<Vertex> weld_vertices(std::span<const Point> vertices, ThreadTeam& team) {
  const auto n_vertices = static_cast<std::int64_t>(vertices.size());
  SUPERFACETS_ASSERT(n_vertices <= std::numeric_limits<Vertex>::max());
  PositionTable table(vertices, team);
  Buffer<PositionTable::Slot> slots(vertices.size());  // hash slot of each vertex
  std::atomic<bool> is_shared = false;
  team.for_each_block(n_vertices, [&](std::int64_t begin, std::int64_t end) {
    if (insert_range(begin, end, table, slots.span())) is_shared = true;
  });
  Buffer<Vertex> representative(vertices.size());
  const bool has_shared = is_shared;
  team.for_each_index(n_vertices, [&](std::int64_t v) {
    representative[v] = has_shared ? table[slots[v]] : static_cast<Vertex>(v);
  });
  return representative;
}

std::vector<Vertex> representatives_of(std::span<const Vertex> representative) {
  std::vector<Vertex> vertices;
  vertices.reserve(representative.size());
  for (Vertex vertex = 0; std::cmp_less(vertex, representative.size()); ++vertex) {
    if (representative[vertex] == vertex) vertices.push_back(vertex);
  }
  return vertices;
}

}  // namespace superfacets
