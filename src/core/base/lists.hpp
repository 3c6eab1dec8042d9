// Lists in a row: those of item i are offsets[i] .. offsets[i + 1] - 1 of their entries.
#pragma once

#include <numeric>
#include <span>

#include "base/assert.hpp"
#include "base/buffer.hpp"

namespace superfacets {

// Some of the lists: their offsets in the result, and the entries to copy.
struct ChosenLists {
  Buffer<std::int64_t> offsets;
  Buffer<std::int64_t> entries;
};

// Time O(number of lists and entries chosen).
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
