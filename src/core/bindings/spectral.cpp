// Bindings of eigenvectors. The functions are documented in the headers of spectral/.
// Their preconditions are checked by superfacets/base/checks.py.
#include "bindings/bindings.hpp"
#include "spectral/border_rates.hpp"
#include "spectral/eigenvectors.hpp"

namespace superfacets {
namespace {

CellRows rows_of(const Table<float>& table) {
  return {table.shape(1), values_of(table)};
}

Buffer<double> sums_between(Offsets offsets, Integers neighbors, Doubles conductances,
                            Doubles steps, Integers coarse_of, Offsets coarse_offsets,
                            Integers coarse_neighbors) {
  return sum_between({offsets, neighbors}, conductances, steps, coarse_of,
                     {coarse_offsets, coarse_neighbors});
}

Buffer<float> relaxed(Offsets offsets, Integers neighbors, Doubles conductances,
                      const Table<float>& rows, int n_sweeps, ThreadTeam& team) {
  return relax({offsets, neighbors}, conductances, rows_of(rows), n_sweeps, team);
}

Buffer<float> rates(const OrderedGraph& graph, Offsets offsets, Integers neighbors, Doubles widths,
                    const Table<float>& normals, const Table<float>& vectors, Doubles coefficients,
                    ThreadTeam& team) {
  return border_rates(graph, {offsets, neighbors}, widths, rows_of(normals), rows_of(vectors),
                      coefficients, team);
}

Eigenpairs eigenpairs(Offsets offsets, Integers neighbors, Doubles conductances, Doubles measures,
                      Integers components, Label n_components, int n_wanted) {
  return smallest_eigenpairs({offsets, neighbors}, conductances, measures, components, n_components,
                             static_cast<std::size_t>(n_wanted));
}

}  // namespace

void bind_spectral(nb::module_& module) {
  module.def("conducting_arcs", threaded<kMinSlowPerThread>(&conducting_arcs), "graph"_a,
             "crease_unit"_a, "steepness"_a, "n_threads"_a);
  module.def("straight_steps", threaded(&straight_steps), "graph"_a, "n_threads"_a);
  module.def("sum_between", serial(&sums_between), "offsets"_a, "neighbors"_a, "conductances"_a,
             "steps"_a, "coarse_of"_a, "coarse_offsets"_a, "coarse_neighbors"_a);
  module.def("relax", threaded<kMinSlowPerThread>(&relaxed), "offsets"_a, "neighbors"_a,
             "conductances"_a, "rows"_a.noconvert(), "n_sweeps"_a, "n_threads"_a);
  module.def("border_rates", threaded<kMinSlowPerThread>(&rates), "graph"_a, "offsets"_a,
             "neighbors"_a, "widths"_a, "normals"_a.noconvert(), "vectors"_a.noconvert(),
             "coefficients"_a, "n_threads"_a);
  module.def("smallest_eigenpairs", serial(&eigenpairs), "offsets"_a, "neighbors"_a,
             "conductances"_a, "measures"_a, "components"_a, "n_components"_a, "n_wanted"_a);
}

}  // namespace superfacets
