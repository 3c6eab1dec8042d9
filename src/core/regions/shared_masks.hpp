// Stage 5: joins regions that masks of images keep together.
#pragma once

#include <cstdint>
#include <span>

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

// Visible areas of K regions in the masks of all images, in CSR form. Each mask is in one image,
// and the masks of an image have consecutive numbers.
struct MaskedAreas {
  std::span<const std::int64_t> offsets;   // (K + 1,)
  std::span<const std::int32_t> masks;     // ascending for each region
  std::span<const double> areas;           // > 0
  std::span<const std::int32_t> image_of;  // image of each mask, ascending
};

// The agreement of two groups of regions is the chance that two points, one of each, that an image
// sees in masks are in the same mask of it: over all images, the sum of the products of their areas
// in the same mask, divided by the sum of the products of their areas in any masks. Starting from
// single regions, the two groups that agree most are joined, until no two agree by at least
// `least`, > 0. Ties go to the groups joined earlier, then to lower regions.
//
// Returns the group of each region, numbered by their lowest regions. Regions without areas are
// groups of their own. Time O(K P L) at most for P groups that share a mask with one, and L masks
// per group; memory O(areas + pairs that share a mask). One thread.
Buffer<Label> join_by_masks(const MaskedAreas& seen, double least);

}  // namespace superfacets
