#include "cells/side_graph.hpp"

#include <stdexcept>
#include <string>

namespace superfacets {

void EdgeTally::count(std::size_t n_faces, bool is_inconsistent) {
  add({{1, std::int64_t{n_faces == 1}, std::int64_t{n_faces > 2}, std::int64_t{is_inconsistent}},
       static_cast<std::uint64_t>(n_faces) * count_linked(static_cast<std::int64_t>(n_faces)),
       static_cast<std::int64_t>(n_faces)});
}

void check_number_of_arcs(const EdgeTally& tally, std::int64_t n_faces) {
  const auto limit =
      static_cast<std::uint64_t>(std::max(kArcsAlwaysAllowed, kArcsPerFaceAllowed * n_faces));
  if (tally.arcs <= limit) return;
  throw std::length_error("the mesh has " + std::to_string(tally.arcs) +
                          " pairs of neighboring faces, more than the limit of " +
                          std::to_string(limit) + "; one edge is shared by " +
                          std::to_string(tally.most_faces) + " faces");
}

}  // namespace superfacets
