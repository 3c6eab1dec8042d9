// Stage 5: whether a region stays connected when it loses a cell, by a local test.
#pragma once

#include <span>

#include "base/types.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Sufficient condition for the region of a cell to stay connected, and not empty, without the cell:
// its neighbors in the region are joined around the corners of the cell or, if corners are unknown,
// by arcs among themselves. The result may be false although a longer path joins them, or if a cell
// has unusually many neighbors. Not moving a cell is always safe.
bool stays_connected_without(const Surface& surface, std::span<const Label> labels, Cell cell);

}  // namespace superfacets
