// Lists stored in one array (CSR form), and functions that build them.
#pragma once

#include <iterator>
#include <numeric>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// List i has the entries offsets[i] .. offsets[i + 1] - 1.
template <typename Entry>
struct Lists {
  Buffer<std::int64_t> offsets;  // (number of lists + 1,) offsets of the lists in `entries`
  Buffer<Entry> entries;

  std::int64_t n_lists() const { return std::ssize(offsets) - 1; }
  std::span<const Entry> operator[](std::int64_t list) const {
    return entries.span().subspan(offsets[list], offsets[list + 1] - offsets[list]);
  }
};

// Groups entries by a counting sort. for_each(add) must call add(list, entry) for each entry, and
// is called twice. Entries keep their order within each list.
template <typename Entry, typename ForEach>
Lists<Entry> group(std::int64_t n_lists, const ForEach& for_each) {
  Lists<Entry> lists{Buffer<std::int64_t>(n_lists + 1), {}};
  Buffer<std::int64_t>& offsets = lists.offsets;
  std::ranges::fill(offsets, 0);
  for_each([&](std::int64_t list, const Entry&) { ++offsets[list]; });
  std::exclusive_scan(offsets.begin(), offsets.end(), offsets.begin(), std::int64_t{0});
  lists.entries = Buffer<Entry>(offsets[n_lists]);
  for_each([&](std::int64_t list, const Entry& entry) { lists.entries[offsets[list]++] = entry; });
  // Each write cursor is now at the end of its list, which is the offset of the next list.
  std::shift_right(offsets.begin(), offsets.end(), 1);
  offsets[0] = 0;
  return lists;
}

// Parallel version of `group`. for_each(begin, end, add) must call add(list, entry) for each of the
// elements begin .. end-1. Each part of the elements has its own write cursors, so the result does
// not depend on the number of threads.
template <typename Entry, typename ForEach>
Lists<Entry> group(std::int64_t n, std::int64_t n_lists, const ForEach& for_each,
                   ThreadTeam& team) {
  // Several parts per thread, to balance the load; but all cursors need less memory than the input.
  const std::int64_t n_parts = std::clamp<std::int64_t>(n / std::max<std::int64_t>(n_lists, 1), 1,
                                                        4 * std::int64_t{team.size()});
  const auto start_of = [&](std::int64_t part) { return n * part / n_parts; };
  // Size of each list in each part, later the write cursors.
  std::vector<Buffer<std::int64_t>> next(n_parts);
  team.for_each(n_parts, [&](std::int64_t part, int) {
    Buffer<std::int64_t> sizes(n_lists);
    std::ranges::fill(sizes, 0);
    for_each(start_of(part), start_of(part + 1),
             [&](std::int64_t list, const Entry&) { ++sizes[list]; });
    next[part] = std::move(sizes);
  });
  Lists<Entry> lists{Buffer<std::int64_t>(n_lists + 1), {}};
  std::int64_t total = 0;
  for (std::int64_t list = 0; list < n_lists; ++list) {
    lists.offsets[list] = total;
    for (Buffer<std::int64_t>& of_part : next) total += std::exchange(of_part[list], total);
  }
  lists.offsets[n_lists] = total;
  lists.entries = Buffer<Entry>(total);
  team.for_each(n_parts, [&](std::int64_t part, int) {
    std::int64_t* const cursors = next[part].data();
    for_each(start_of(part), start_of(part + 1), [&](std::int64_t list, const Entry& entry) {
      lists.entries[cursors[list]++] = entry;
    });
  });
  return lists;
}

// Sorts a list and removes its duplicates.
template <typename Entry>
void sort_unique(std::vector<Entry>& list) {
  std::ranges::sort(list);
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

// Sorts each list and removes its duplicates.
template <typename Entry>
void sort_unique(Lists<Entry>& lists, ThreadTeam& team) {
  Lists<Entry> kept{Buffer<std::int64_t>(lists.offsets.size()), {}};
  team.for_each_index(lists.n_lists(), [&](std::int64_t list) {
    Entry* const begin = lists.entries.data() + lists.offsets[list];
    Entry* const end = lists.entries.data() + lists.offsets[list + 1];
    std::sort(begin, end);
    kept.offsets[list] = std::unique(begin, end) - begin;
  });
  std::int64_t total = 0;
  for (std::int64_t& offset : kept.offsets.span().first(lists.n_lists())) {
    total += std::exchange(offset, total);
  }
  kept.offsets[lists.n_lists()] = total;
  kept.entries = Buffer<Entry>(total);
  team.for_each_index(lists.n_lists(), [&](std::int64_t list) {
    std::copy_n(lists[list].begin(), kept[list].size(), kept.entries.data() + kept.offsets[list]);
  });
  lists = std::move(kept);
}

// Collects the entries that append(cell, list) appends to `list` for cells 0..n-1, in the order of
// cells. Each block of cells fills a separate list. Blocks do not depend on the number of threads.
template <typename Entry, typename Append>
Buffer<Entry> gather(std::int64_t n, const Append& append, ThreadTeam& team) {
  constexpr std::int64_t kBlock = 1 << 14;
  std::vector<std::vector<Entry>> lists((n + kBlock - 1) / kBlock);
  const auto append_range = [&](std::int64_t begin, std::int64_t end) {
    // A local list, because threads that append to adjacent vectors of `lists` would write to the
    // same cache lines.
    std::vector<Entry> list;
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) append(cell, list);
    lists[begin / kBlock] = std::move(list);
  };
  team.for_each_block(n, append_range, kBlock);
  std::size_t size = 0;
  for (const std::vector<Entry>& list : lists) size += list.size();
  Buffer<Entry> all(size);
  Entry* next = all.data();
  for (const std::vector<Entry>& list : lists) next = std::copy(list.begin(), list.end(), next);
  return all;
}

}  // namespace superfacets
