#include "weld.hpp"

#include <bit>

namespace superfacets {
namespace {

constexpr Vertex kEmptySlot = -1;

// The finalizer of splitmix64: every input bit reaches every output bit, so that regular grids of
// positions do not cluster in the table.
std::uint64_t mix(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9ULL;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebULL;
  return bits ^ (bits >> 31);
}

std::uint64_t hash(Point p) {
  // Adding 0.0 turns -0.0 into 0.0, which compares equal to it and so must hash alike.
  std::uint64_t h = mix(std::bit_cast<std::uint64_t>(p.x + 0.0));
  h = mix(h + std::bit_cast<std::uint64_t>(p.y + 0.0));
  return mix(h + std::bit_cast<std::uint64_t>(p.z + 0.0));
}

bool same_position(Point a, Point b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

}  // namespace

std::vector<Vertex> weld_vertices(std::span<const Point> vertices) {
  // Open addressing with linear probing in a table at most half full.
  const std::size_t table_size = std::bit_ceil(2 * vertices.size() + 1);
  std::vector<Vertex> table(table_size, kEmptySlot);    // first vertex of each position
  std::vector<Vertex> representative(vertices.size());  // the result
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    std::size_t slot = hash(vertices[v]) & (table_size - 1);
    while (table[slot] != kEmptySlot && !same_position(vertices[table[slot]], vertices[v])) {
      slot = (slot + 1) & (table_size - 1);
    }
    if (table[slot] == kEmptySlot) table[slot] = static_cast<Vertex>(v);
    representative[v] = table[slot];
  }
  return representative;
}

}  // namespace superfacets
