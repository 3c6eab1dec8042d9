// Bindings of shortest paths. The functions are documented in the headers of paths/. Graphs of
// users are checked by superfacets/_validate.py; arguments of improve_paths are not checked.
#include "bindings/bindings.hpp"
#include "paths/path_lengths.hpp"
#include "paths/tile_paths.hpp"

namespace superfacets {
namespace {

// Minimum number of source cells per thread. Computing the paths from this number of sources takes
// longer than starting a thread.
constexpr std::int64_t kMinSources = 64;

TilePaths improved_paths(Offsets offsets, Integers targets, Floats arc_lengths,
                         std::span<const PathLength> lengths, Integers labels, Integers places,
                         std::span<const PathLength> proposed_lengths, Integers proposed_labels,
                         ThreadTeam& team) {
  return improve_paths({offsets, targets, arc_lengths}, lengths, labels,
                       {places, proposed_lengths, proposed_labels}, team);
}

}  // namespace

void bind_paths(nb::module_& module) {
  module.def("improve_paths", threaded(&improved_paths), "offsets"_a, "targets"_a, "arc_lengths"_a,
             "lengths"_a, "labels"_a, "places"_a, "proposed_lengths"_a, "proposed_labels"_a,
             "n_threads"_a);
  module.def("path_lengths", threaded<kMinSources>(&path_lengths), "graph"_a, "sources"_a, "unit"_a,
             "n_threads"_a);
  module.def("path_lengths_within", threaded<kMinSources>(&path_lengths_within), "graph"_a,
             "reach"_a, "unit"_a, "n_threads"_a);
}

}  // namespace superfacets
