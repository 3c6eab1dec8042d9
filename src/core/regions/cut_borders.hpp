// Stage 5: cuts faces so that regions get smooth borders.
#pragma once

#include "regions/border_field.hpp"

namespace superfacets {

struct CutMesh {
  Buffer<Point> vertices;  // input vertices, then crossings on edges, then junctions inside faces
  Buffer<Triangle> faces;  // all parts of input face 0, followed by all parts of face 1, and so on
  Buffer<Label> labels;    // label of each part
  Buffer<Face> sources;    // input face of each part
};

// Cuts faces along smooth borders (see BorderField), into at most six parts each. All faces of an
// edge are cut at the same point, so there are no T-junctions. The point is computed for the welded
// ends, so unwelded seams get no gaps. Parts keep the orientation of their face. A region may
// become disconnected or lose all of its area. The caller must detect such regions, and call the
// function again with their faces marked as kept.
//
// Throws std::length_error if there are too many parts or vertices to index.
CutMesh cut_borders(const LabeledMesh& mesh, const CutOptions& options, ThreadTeam& team);

}  // namespace superfacets
