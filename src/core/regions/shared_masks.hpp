// Stage 5: joins regions that share masks in images.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

// Visible area of each of K regions in each mask of all images, in CSR form. Each mask belongs to
// one image, and the masks of an image have consecutive numbers.
struct MaskedAreas {
  std::span<const std::int64_t> offsets;   // (K + 1,)
  std::span<const std::int32_t> masks;     // (n,) masks of each region, ascending
  std::span<const double> areas;           // > 0
  std::span<const std::int32_t> image_of;  // image of each mask, ascending
};

// Repeatedly joins the two groups of regions with the highest agreement, until no two groups have
// an agreement of `least`, > 0. At first each region is a group. The agreement of two groups is the
// probability that a random point of each group, both in masks of one image, are in the same mask:
// the sum over all images of products of areas in the same mask, divided by the sum of products of
// areas in any two masks of the image. Ties go to the groups joined earlier, then to lower regions.
//
// Returns the group of each region, (K,). Groups are numbered in the order of their lowest regions.
// A region without areas is a group of its own. Time at most O(K P L), if each group shares masks
// with at most P other groups and has at most L masks. Memory: O(areas + pairs of regions that
// share a mask). Runs on one thread.
Buffer<Label> join_by_masks(const MaskedAreas& seen, double least);

}  // namespace superfacets
