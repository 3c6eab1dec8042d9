// Stage 5: whether a region stays in one piece when it loses a cell, from what lies around the
// cell.
#pragma once

#include <span>

#include "base/types.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Whether the region of a cell surely stays connected, and keeps some cell, without this one: the
// neighbors in the region are joined around the corners of the cell, or, where corners are not
// known, by arcs among themselves. May be false where a longer way joins them, and where there is
// more to look at than on any ordinary surface: to leave a cell where it is never breaks a region.
bool stays_connected_without(const Surface& surface, std::span<const Label> labels, Cell cell);

}  // namespace superfacets
