// Bindings of spatial search and sorting. The functions are documented in the headers of spatial/.
// Their preconditions are checked by superfacets/base/checks.py.
#include "bindings/bindings.hpp"
#include "spatial/nearest_cell.hpp"
#include "spatial/sorted_mesh.hpp"
#include "spatial/views.hpp"

namespace superfacets {
namespace {

SortedMesh mesh_in_curve_order(Points vertices, Integers representative, Integers corners,
                               Offsets offsets, std::int64_t size, bool are_faces,
                               ThreadTeam& team) {
  return sort_mesh(vertices, representative, {corners, offsets, size}, are_faces, team);
}

// `numbers` has one row per view: the 12 numbers of the projection, followed by the product of the
// focal lengths. `sizes` contains the width and height of each image.
auto surface_seen(Points vertices, Triangles faces, const Table<double>& numbers, Integers sizes,
                  int n_threads) {
  std::vector<View> views(numbers.shape(0));
  SUPERFACETS_ASSERT(numbers.shape(1) == 13 && sizes.size() == 2 * views.size());
  std::size_t work = views.size() * faces.size();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double* row = numbers.data() + 13 * i;
    std::copy_n(row, 12, views[i].projection);
    views[i].focal_product = row[12];
    views[i].width = sizes[2 * i];
    views[i].height = sizes[2 * i + 1];
    work += static_cast<std::size_t>(views[i].n_pixels());
  }
  return on_team(work, n_threads,
                 [&](ThreadTeam& team) { return see_surface(vertices, faces, views, team); });
}

// Minimum number of cells or queries per thread. Inserting a cell into the search tree takes about
// a microsecond, and a query takes about as long.
constexpr std::int64_t kMinSearched = 1 << 10;

}  // namespace

void bind_spatial(nb::module_& module) {
  module.def("sort_mesh", threaded(&mesh_in_curve_order), "vertices"_a, "representative"_a,
             "corners"_a, "offsets"_a, "size"_a, "are_faces"_a, "n_threads"_a);
  module.def("nearest_triangles", threaded<kMinSearched>(&nearest_triangles), "vertices"_a,
             "faces"_a, "queries"_a, "max_distance"_a, "n_threads"_a);
  module.def("nearest_tets", threaded<kMinSearched>(&nearest_tets), "vertices"_a, "tets"_a,
             "queries"_a, "max_distance"_a, "n_threads"_a);
  module.def("nearest_points", threaded<kMinSearched>(&nearest_points), "positions"_a, "queries"_a,
             "max_distance"_a, "n_threads"_a);
  module.def("see_surface", &surface_seen, "vertices"_a, "faces"_a, "views"_a, "sizes"_a,
             "n_threads"_a);
}

}  // namespace superfacets
