// Stage 5: joins line segments of borders into polylines.
#pragma once

#include "base/types.hpp"

namespace superfacets {

// One end of a segment: 2 i is the start point of segment i, and 2 i + 1 is its end point.
using SegmentEnd = std::int64_t;

inline constexpr SegmentEnd kNoEnd = -1;

struct Lines {
  std::vector<std::int64_t> offsets;     // (L + 1,) start of each line in `entries`
  std::vector<SegmentEnd> entries;       // (S,) end at which a line enters each of its segments
  std::vector<std::uint8_t> are_closed;  // (L,) 1 if the line is closed
};

// Follows each line from segment to segment. For each end of a segment, `partners` contains the
// adjacent end of the next segment, or kNoEnd. If b is the partner of a, a must be the partner of
// b. In the result, open lines precede closed lines. An open line begins at the start point of a
// segment, if one of its two ends is a start point. A closed line begins at the start point of its
// lowest segment. Time O(S).
Lines trace_lines(std::span<const SegmentEnd> partners);

}  // namespace superfacets
