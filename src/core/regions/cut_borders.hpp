// Stage 5: regions with smooth borders, which cut through faces.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "regions/border_field.hpp"
#include "regions/labeled_mesh.hpp"

namespace superfacets {

struct CutMesh {
  Buffer<Point> vertices;  // the old ones, then crossings of edges, then junctions within faces
  Buffer<Triangle> faces;  // all parts of face 0, then of face 1, ...
  Buffer<Label> labels;    // of the new faces
  Buffer<Face> sources;    // the old face of each new face
};

// Cuts faces along smooth borders (see BorderField), into at most six parts each. An edge is cut at
// one point in all of its faces, so that no T-junctions appear; the position depends on the
// positions of its ends, not on their numbers, so that unwelded seams stay without gaps. Parts keep
// the orientation of their face. Regions may lose their connection, or all of their area: the
// caller checks that, and marks faces of such regions as kept.
//
// Throws std::length_error if there are too many parts or vertices to index.
CutMesh cut_borders(const LabeledMesh& mesh, const CutOptions& options, ThreadTeam& team);

}  // namespace superfacets
