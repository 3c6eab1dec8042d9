// Stage 5: joins segments of borders into lines.
#pragma once

#include "base/types.hpp"

namespace superfacets {

// An end of a segment: 2 i for the start of segment i, 2 i + 1 for its end.
using SegmentEnd = std::int64_t;

inline constexpr SegmentEnd kNoEnd = -1;

struct Lines {
  std::vector<std::int64_t> offsets;     // (L + 1,) line i: entries[offsets[i]] .. [offsets[i+1]-1]
  std::vector<SegmentEnd> entries;       // (S,) the end at which a line enters each of its segments
  std::vector<std::uint8_t> are_closed;  // (L,) 1: the line is closed
};

// Follows each line from segment to segment. For each end of a segment, `partners` holds the end of
// the adjacent segment, or kNoEnd. Partners are mutual. Open lines come first. An open line begins
// at the start of a segment, if one of its two ends is a start. Closed lines follow, and begin at
// the start of their lowest segment. Time O(S).
Lines trace_lines(std::span<const SegmentEnd> partners);

}  // namespace superfacets
