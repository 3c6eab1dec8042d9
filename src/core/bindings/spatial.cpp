// Bindings of spatial search and sorting. The functions are documented in the headers of spatial/.
// Their preconditions are checked by superfacets/_validate.py.
#include "bindings/bindings.hpp"
#include "spatial/box_tree.hpp"
#include "spatial/morton.hpp"
#include "spatial/nearest_cell.hpp"
#include "spatial/point_tiles.hpp"
#include "spatial/ray_thickness.hpp"
#include "spatial/sorted_mesh.hpp"
#include "spatial/views.hpp"

namespace superfacets {
namespace {

SortedMesh mesh_in_curve_order(Points vertices, Integers representative, Integers corners,
                               Offsets offsets, std::int64_t size, ThreadTeam& team) {
  return sort_mesh(vertices, representative, {corners, offsets, size}, team);
}

// The number of threads is chosen as if the rays cast from one starting point took as long as
// building the tree for a hundred faces.
auto thickness(Points vertices, Triangles faces, Points starts, Points axes, int n_rays,
               double least_distance, bool inside_out, int n_threads) {
  const RayOptions options{n_rays, least_distance, inside_out};
  return on_team(faces.size() + 100 * starts.size(), n_threads, [&](ThreadTeam& team) {
    return ray_thickness(vertices, faces, starts, axes, options, team);
  });
}

Buffer<std::uint32_t> codes_within(Points positions, Point low, Point high, ThreadTeam& team) {
  return morton_codes(positions, {low, high}, team);
}

Buffer<Cell> ordered_within_steps(Points positions, std::span<const std::uint32_t> codes,
                                  ThreadTeam& team) {
  return order_within_steps(positions, codes, BoxTree::kLeaf, team);
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
             "corners"_a, "offsets"_a, "size"_a, "n_threads"_a);
  module.def("ray_thickness", &thickness, "vertices"_a, "faces"_a, "starts"_a, "axes"_a, "n_rays"_a,
             "least_distance"_a, "inside_out"_a, "n_threads"_a);
  module.def("morton_codes", threaded(&codes_within), "positions"_a, "low"_a, "high"_a,
             "n_threads"_a);
  module.def("order_within_steps", threaded(&ordered_within_steps), "positions"_a, "codes"_a,
             "n_threads"_a);
  module.def("nearest_in_part", threaded(&nearest_in_part), "positions"_a, "is_wanted"_a,
             "n_nearest"_a, "n_threads"_a);
  module.def("directions_around", threaded(&directions_around), "positions"_a, "axes"_a,
             "centers"_a, "rows"_a, "n_threads"_a);
  module.def("sorted_lists", serial(&sorted_lists), "n_cells"_a, "sources"_a, "targets"_a);
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
