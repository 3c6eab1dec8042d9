// Stage 5: joins regions that are visible in the same masks of images.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

// Visible area of each of K regions in each image mask, in CSR form. Each mask belongs to one
// image, and the masks of an image have consecutive numbers.
struct MaskedAreas {
  std::span<const std::int64_t> offsets;   // (K + 1,) start of each region in `masks` and `areas`
  std::span<const std::int32_t> masks;     // (n,) masks of each region, ascending
  std::span<const double> areas;           // (n,) visible area of the region in each mask, > 0
  std::span<const std::int32_t> image_of;  // (masks,) image of each mask, ascending
};

// Repeatedly joins the two groups of regions with the highest agreement, until no two groups have
// an agreement of at least `least` > 0. Initially, each region is a group. The agreement of two
// groups is the probability that two random points, one of each group and both in masks of the same
// image, are in the same mask. This is the sum over all images of the products of areas in the same
// mask, divided by the sum of the products of areas in any two masks of the image. If several pairs
// have the same agreement, the lowest pair is first; a new group gets the highest number.
//
// Returns the group of each region, (K,). Groups are numbered in the order of their lowest regions.
// A region that is not visible in any mask is not joined. Time at most O(K P L), if each group
// shares masks with at most P other groups and has at most L masks. Memory is O(number of areas +
// number of pairs of regions that share a mask). Runs on one thread.
Buffer<Label> join_by_masks(const MaskedAreas& seen, double least);

}  // namespace superfacets
