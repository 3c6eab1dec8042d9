// Shared by all bindings: views of input arrays, and arrays that own the results.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <tuple>
#include <utility>

#include "base/buffer.hpp"
#include "base/team_scope.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {

namespace nb = nanobind;
using namespace nb::literals;

template <typename T>
using Array = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Rows = nb::ndarray<const T, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Table = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <typename T>
using NewArray = nb::ndarray<nb::numpy, T, nb::ndim<1>, nb::c_contig>;
using NewRows = nb::ndarray<nb::numpy, double, nb::shape<-1, 3>, nb::c_contig>;
using NewTriangles = nb::ndarray<nb::numpy, Vertex, nb::shape<-1, 3>, nb::c_contig>;

template <typename T>
std::span<const T> view(const Array<T>& array) {
  return {array.data(), array.shape(0)};
}

inline std::span<const Point> points(const Rows<double>& rows) {
  return {reinterpret_cast<const Point*>(rows.data()), rows.shape(0)};
}

inline std::span<const Triangle> triangles(const Rows<Vertex>& rows) {
  return {reinterpret_cast<const Triangle*>(rows.data()), rows.shape(0)};
}

inline Polygons polygons(const Array<std::int64_t>& offsets, const Array<Vertex>& corners) {
  return {view(offsets), view(corners)};
}

// Moves a vector to the heap and returns it with the capsule that will delete it.
template <typename T>
std::pair<std::vector<T>*, nb::capsule> own(std::vector<T>&& values) {
  values.reserve(1);  // numpy wants a valid pointer for an empty array too
  auto* owned = new std::vector<T>(std::move(values));
  return {owned,
          nb::capsule(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); })};
}

template <typename T>
NewArray<T> to_numpy(std::vector<T>&& values) {
  auto [owned, owner] = own(std::move(values));
  return NewArray<T>(owned->data(), {owned->size()}, owner);
}

inline NewRows to_numpy(std::vector<Point>&& values) {
  auto [owned, owner] = own(std::move(values));
  return NewRows(reinterpret_cast<double*>(owned->data()), {owned->size(), 3}, owner);
}

template <typename T>
NewArray<T> to_numpy(Buffer<T>&& values) {
  auto* owned = new Buffer<T>(std::move(values));
  const nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<Buffer<T>*>(p); });
  return NewArray<T>(owned->data(), {owned->size()}, owner);
}

inline NewRows to_numpy(Buffer<Point>&& values) {
  auto* owned = new Buffer<Point>(std::move(values));
  const nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<Buffer<Point>*>(p); });
  return NewRows(reinterpret_cast<double*>(owned->data()), {owned->size(), 3}, owner);
}

inline NewTriangles to_numpy(Buffer<Triangle>&& values) {
  auto* owned = new Buffer<Triangle>(std::move(values));
  const nb::capsule owner(owned,
                          [](void* p) noexcept { delete static_cast<Buffer<Triangle>*>(p); });
  return NewTriangles(reinterpret_cast<Vertex*>(owned->data()), {owned->size(), 3}, owner);
}

inline Point as_point(const std::tuple<double, double, double>& xyz) {
  return {std::get<0>(xyz), std::get<1>(xyz), std::get<2>(xyz)};
}

inline std::tuple<double, double, double> as_tuple(Point p) {
  return {p.x, p.y, p.z};
}

// Calls a kernel with the GIL released; arguments are bound before and results wrapped after.
template <typename Kernel>
auto without_gil(const Kernel& kernel) {
  const nb::gil_scoped_release release;
  return kernel();
}

// The same, with a team of a number of threads that suits n elements.
template <typename Kernel>
auto on_team(std::size_t n, int n_threads, const Kernel& kernel,
             std::int64_t min_per_thread = kMinPerThread) {
  const nb::gil_scoped_release release;
  TeamLease lease(useful_threads(static_cast<std::int64_t>(n), n_threads, min_per_thread));
  return kernel(lease.team());
}

void bind_base(nb::module_& module);               // what tests compare
void bind_mesh(nb::module_& module);               // stage 0
void bind_cells(nb::module_& module);              // 1 and 2
void bind_clustering_stages(nb::module_& module);  // 3 and 4
void bind_regions(nb::module_& module);            // 5
void bind_text(nb::module_& module);
void bind_study(nb::module_& module);

}  // namespace superfacets
