// Lists stored one after the other: list i has the entries offsets[i] .. offsets[i + 1] - 1.
#pragma once

#include <numeric>
#include <span>

#include "base/assert.hpp"
#include "base/buffer.hpp"

namespace superfacets {

// Selected lists: their offsets after copying, (n + 1,), and the index of each entry to copy.
struct ChosenLists {
  Buffer<std::int64_t> offsets;
  Buffer<std::int64_t> entries;
};

// Selects the lists with the indices `chosen`, in that order. Time O(chosen lists + their entries).
inline ChosenLists choose_lists(std::span<const std::int64_t> offsets,
                                std::span<const std::int64_t> chosen) {
  SUPERFACETS_ASSERT(all_below(chosen, std::ssize(offsets) - 1));
  ChosenLists lists{Buffer<std::int64_t>(chosen.size() + 1), {}};
  lists.offsets[0] = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    lists.offsets[i + 1] = lists.offsets[i] + offsets[chosen[i] + 1] - offsets[chosen[i]];
  }
  lists.entries = Buffer<std::int64_t>(lists.offsets[chosen.size()]);
  std::int64_t* entry = lists.entries.data();
  for (const std::int64_t list : chosen) {
    std::iota(entry, entry + (offsets[list + 1] - offsets[list]), offsets[list]);
    entry += offsets[list + 1] - offsets[list];
  }
  return lists;
}

}  // namespace superfacets
