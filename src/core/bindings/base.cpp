// Bindings of the base layer: rows of lists, and for tests features of the build, and arithmetic
// whose errors are measured.
#include <optional>

#include "base/arctangent.hpp"
#include "base/assert.hpp"
#include "base/exponential.hpp"
#include "base/heap.hpp"
#include "base/lists.hpp"
#include "base/team_scope.hpp"
#include "bindings/bindings.hpp"

namespace superfacets {
namespace {

auto bind_arctangents(const Array<double>& y, const Array<double>& x, int instruction_set) {
  Buffer<double> angles(y.shape(0));
  arctangents(view(y), view(x), angles.span(), static_cast<InstructionSet>(instruction_set));
  return to_numpy(std::move(angles));
}

auto bind_exponentials(const Array<double>& x) {
  Buffer<double> powers(x.shape(0));
  exponentials(view(x), powers.span());
  return to_numpy(std::move(powers));
}

auto bind_choose_lists(const Array<std::int64_t>& offsets, const Array<std::int64_t>& chosen) {
  const auto input = std::pair(view(offsets), view(chosen));
  ChosenLists lists = without_gil([&] { return choose_lists(input.first, input.second); });
  return std::tuple(to_numpy(std::move(lists.offsets)), to_numpy(std::move(lists.entries)));
}

// A TeamScope for the kernels of one call; entered and left on one thread.
class Workspace {
 public:
  void enter() { team_.emplace(); }
  void leave() { team_.reset(); }

 private:
  std::optional<TeamScope> team_;
};

// A HeapScope, as a context.
class KeptHeap {
 public:
  explicit KeptHeap(std::size_t n_bytes) : n_bytes_(n_bytes) {}
  void enter() { heap_.emplace(n_bytes_); }
  void leave() { heap_.reset(); }

 private:
  std::size_t n_bytes_;
  std::optional<HeapScope> heap_;
};

}  // namespace

void bind_base(nb::module_& module) {
  module.def("has_assertions", [] { return kHasAssertions; });
  module.def("best_instruction_set", [] { return static_cast<int>(best_instruction_set()); });
  nb::class_<Workspace>(module, "Workspace")
      .def(nb::init<>())
      .def("__enter__", &Workspace::enter)
      .def(
          "__exit__", [](Workspace& workspace, const nb::args&) { workspace.leave(); },
          nb::sig("def __exit__(self, *exception: object) -> None"));
  nb::class_<KeptHeap>(module, "KeptHeap")
      .def(nb::init<std::size_t>(), "n_bytes"_a)
      .def("__enter__", &KeptHeap::enter)
      .def(
          "__exit__", [](KeptHeap& heap, const nb::args&) { heap.leave(); },
          nb::sig("def __exit__(self, *exception: object) -> None"));
  module.def("arctangents", &bind_arctangents, "y"_a.noconvert(), "x"_a.noconvert(),
             "instruction_set"_a);
  module.def("choose_lists", &bind_choose_lists, "offsets"_a.noconvert(), "chosen"_a.noconvert());
  module.def("exponentials", &bind_exponentials, "x"_a.noconvert());
}

}  // namespace superfacets
