// Bindings of methods to compare with. What each function does stands in its header; what it may
// assume, in superfacets/_validate.py.
#include <new>

#include "bindings.hpp"
#include "vsa.hpp"

namespace superfacets {
namespace {

void bind_proxy_regions(ProxyRegions* self, const Rows<double>& vertices, const Rows<Vertex>& faces,
                        const Array<double>& areas, const Array<std::int64_t>& offsets,
                        const Array<Face>& neighbors, ProxyMetric metric,
                        const Array<Face>& seeds) {
  const auto mesh = std::pair(points(vertices), triangles(faces));
  const auto arcs = std::pair(view(offsets), view(neighbors));
  const auto measures = view(areas);
  const auto first = view(seeds);
  without_gil([&] {
    ProxySurface surface =
        make_proxy_surface(mesh.first, mesh.second, measures, arcs.first, arcs.second);
    return new (self) ProxyRegions(std::move(surface), metric, first);
  });
}

std::int64_t bind_relax(ProxyRegions& regions) {
  return without_gil([&] { return regions.relax(); });
}

void bind_insert(ProxyRegions& regions) {
  without_gil([&] { regions.insert(); });
}

auto bind_proxy_labels(const ProxyRegions& regions) {
  return to_numpy(std::vector(regions.labels()));
}

auto bind_proxy_seeds(const ProxyRegions& regions) {
  return to_numpy(std::vector(regions.seeds()));
}

}  // namespace

void bind_rivals(nb::module_& module) {
  nb::enum_<ProxyMetric>(module, "ProxyMetric")
      .value("L2", ProxyMetric::kL2)
      .value("L21", ProxyMetric::kL21);
  nb::class_<ProxyRegions>(module, "ProxyRegions")
      .def("__init__", &bind_proxy_regions, "vertices"_a.noconvert(), "faces"_a.noconvert(),
           "areas"_a.noconvert(), "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "metric"_a,
           "seeds"_a.noconvert())
      .def_prop_ro("n_regions", &ProxyRegions::n_regions)
      .def("relax", &bind_relax)
      .def("insert", &bind_insert)
      .def("labels", &bind_proxy_labels)
      .def("seeds", &bind_proxy_seeds);
}

}  // namespace superfacets
