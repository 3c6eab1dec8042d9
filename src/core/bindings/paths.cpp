// Bindings of shortest paths. The functions are documented in the headers of paths/. Graphs of
// users are checked by superfacets/base/checks.py.
#include "bindings/bindings.hpp"
#include "paths/path_lengths.hpp"

namespace superfacets {
namespace {

// Minimum number of source cells per thread. Computing the paths from this number of sources takes
// longer than starting a thread.
constexpr std::int64_t kMinSources = 64;

}  // namespace

void bind_paths(nb::module_& module) {
  module.def("path_lengths_within", threaded<kMinSources>(&path_lengths_within), "graph"_a,
             "reach"_a, "unit"_a, "n_threads"_a);
}

}  // namespace superfacets
