// Bindings of the base layer, and properties of the build (for tests).

#include "base/elementary.hpp"
#include "base/lists.hpp"
#include "bindings/bindings.hpp"

namespace superfacets {
namespace {

Buffer<double> arctangents_of(Doubles y, Doubles x, int instruction_set) {
  Buffer<double> angles(y.size());
  arctangents(y, x, angles.span(), static_cast<InstructionSet>(instruction_set));
  return angles;
}

Buffer<double> exponentials_of(Doubles x) {
  Buffer<double> powers(x.size());
  exponentials(x, powers.span());
  return powers;
}

// Rounds to single precision.
Buffer<float> narrowed(Doubles values, ThreadTeam& team) {
  Buffer<float> found(values.size());
  team.for_each_index(std::ssize(values),
                      [&](std::int64_t i) { found[i] = static_cast<float>(values[i]); });
  return found;
}

// Python context manager that opens a TeamScope on entry and closes it on exit. Entry and exit must
// be on the same thread.
struct Workspace {
  std::optional<TeamScope> scope;
};

}  // namespace

void bind_base(nb::module_& module) {
  module.def("has_assertions", [] { return kHasAssertions; });
  module.def("best_instruction_set", [] { return static_cast<int>(best_instruction_set()); });
  nb::class_<Workspace>(module, "Workspace")
      .def(nb::init<>())
      .def("__enter__", [](Workspace& workspace) { workspace.scope.emplace(); })
      .def(
          "__exit__", [](Workspace& workspace, const nb::args&) { workspace.scope.reset(); },
          nb::sig("def __exit__(self, *exception: object) -> None"));
  module.def("arctangents", serial(&arctangents_of), "y"_a, "x"_a, "instruction_set"_a);
  module.def("sum_of", threaded(&sum_of), "values"_a, "n_threads"_a);
  module.def("narrowed", threaded(&narrowed), "values"_a, "n_threads"_a);
  module.def("exponentials", serial(&exponentials_of), "x"_a);
}

}  // namespace superfacets
