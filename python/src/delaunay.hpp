// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/delaunay3.hpp>
#include <terrace/tri/dynamic_surface.hpp>
#include <terrace/tri/metric.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {

template <class Number, std::size_t N>
bool finite(const std::array<Number, N>& p) {
  return std::all_of(p.begin(), p.end(), [](Number c) { return c - c == 0; });
}

/// Returns the indices of places in Morton order, in which successive places are mostly close
/// together, so that walks between them are short.
template <std::size_t N>
std::vector<std::size_t> near_order(std::span<const std::array<double, N>> places) {
  constexpr unsigned kBits = 16;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, N> low, high;
  low.fill(kInfinity);
  high.fill(-kInfinity);
  for (const auto& p : places) {
    for (std::size_t i = 0; i < N && finite(p); ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  std::vector<std::pair<std::uint64_t, std::size_t>> keys(places.size());
  for (std::size_t at = 0; at < places.size(); ++at) {
    keys[at].second = at;
    if (!finite(places[at])) continue;
    std::array<std::uint32_t, N> cell{};
    for (std::size_t i = 0; i < N; ++i) {
      // Halved so that differences cannot overflow.
      const double share = (places[at][i] / 2 - low[i] / 2) / (high[i] / 2 - low[i] / 2);
      cell[i] = share > 0 ? static_cast<std::uint32_t>(share * ((1U << kBits) - 1)) : 0;
    }
    for (unsigned bit = kBits; bit-- > 0;) {
      for (const std::uint32_t c : cell) keys[at].first = keys[at].first << 1 | (c >> bit & 1);
    }
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::size_t> order;
  order.reserve(keys.size());
  for (const auto& [key, at] : keys) order.push_back(at);
  return order;
}

/// Differences between kinds of meshes: the number kCorners of a simplex's corners, the ids of
/// simplices and access to them.
template <std::size_t N, class Metric>
struct Triangulation;
template <class Metric>
struct Triangulation<2, Metric> {
  using Type = tri::Delaunay2<double, Metric>;
  using Simplex = tri::TriangleId;
  static constexpr std::size_t kCorners = 3;
  static void settle(Type&) {}
  static const auto& added(const typename Type::Changes& of) { return of.added_triangles; }
  static auto all(const Type& of) { return of.all_triangles(); }
  static std::size_t count(const Type& of) { return of.triangle_count(); }
  static std::uint32_t slots(const Type& of) { return of.triangle_slots(); }
  static Simplex found(const Type& of, const typename Type::Point& p, tri::VertexId& hint) {
    const tri::Location at = of.locate(p, hint);
    hint = at.vertex;
    return at.place == tri::Place::outside ? tri::kNoTriangle : at.triangle;
  }
};
template <class Metric>
struct Triangulation<3, Metric> {
  using Type = tri::Delaunay3<double, Metric>;
  using Simplex = tri::TetrahedronId;
  static constexpr std::size_t kCorners = 4;
  static void settle(Type&) {}
  static const auto& added(const typename Type::Changes& of) { return of.added_tetrahedra; }
  static auto all(const Type& of) { return of.all_tetrahedra(); }
  static std::size_t count(const Type& of) { return of.tetrahedron_count(); }
  static std::uint32_t slots(const Type& of) { return of.tetrahedron_slots(); }
  static Simplex found(const Type& of, const typename Type::Point& p, tri::VertexId& hint) {
    const tri::Location3 at = of.locate(p, hint);
    hint = at.vertex;
    return at.place == tri::Place3::outside ? tri::kNoTetrahedron : at.tetrahedron;
  }
};

/// The surface of points in space.
struct SurfaceKind {
  using Type = tri::DynamicSurface<double>;
  static constexpr std::size_t kCorners = 3;
  static void settle(Type& of) { of.follow(); }
  static const auto& added(const Type::Changes& of) { return of.added_triangles; }
  static auto all(const Type& of) { return of.all_triangles(); }
  static std::size_t count(const Type& of) { return of.triangle_count(); }
};

/// A triangulation that Python's threads may share; one works on it at a time.
template <std::size_t N, class Metric = tri::Euclidean, class Kind_ = Triangulation<N, Metric>>
class SharedDelaunay {
 public:
  using Kind = Kind_;
  using Mesh = typename Kind::Type;
  using Point = std::array<double, N>;
  using Row = std::array<std::int32_t, Kind::kCorners>;

  SharedDelaunay() = default;
  explicit SharedDelaunay(const Metric& metric) : mesh_(metric) {}

  /// Returns work(mesh), which changes the mesh. items: a measure of the work.
  template <class Work>
  auto change(std::size_t items, Work&& work) {
    return locked(items + size_, [&] { return work(mesh_); });
  }

  /// Returns work(mesh) or work(mesh, stop token), which only reads the mesh and takes about as
  /// long as a pass over it and over `items` items.
  template <class Work>
  auto read(std::size_t items, Work&& work) {
    if constexpr (std::is_invocable_v<Work, const Mesh&, const std::stop_token&>) {
      return locked(items + size_,
                    [&](const std::stop_token& stop) { return work(std::as_const(mesh_), stop); });
    } else {
      return locked(items + size_, [&] { return work(std::as_const(mesh_)); });
    }
  }

  py::array_t<std::int32_t> insert(const Array<double>& input) {
    const auto points = rows_of<N>(input, "points");
    return to_array(locked(points.size(), [&](const std::stop_token& stop) {
      std::vector<std::int32_t> handles(points.size());
      if (mesh_.vertex_count() == 0) {
        const std::vector<tri::VertexId> solution = build(points, stop);
        for (std::size_t i = 0; i < solution.size(); ++i) handles[i] = handle(solution[i]);
        return handles;
      }
      std::vector<typename Mesh::Insertion> solution(points.size());
      // A stop ends the call between portions, and the points inserted so far stay. All points are
      // checked first, so that invalid ones change nothing; insert() names the first of them.
      constexpr std::size_t kPortion = 100'000;
      const bool valid = std::all_of(points.begin(), points.end(), finite<double, N>);
      const std::size_t portion = valid ? kPortion : points.size();
      for (std::size_t at = 0; at < points.size() && !stop.stop_requested(); at += portion) {
        const std::size_t count = std::min(portion, points.size() - at);
        mesh_.insert(points.subspan(at, count), std::span(solution).subspan(at, count));
      }
      Kind::settle(mesh_);
      if (stop.stop_requested()) throw stream::Stopped();
      for (std::size_t i = 0; i < solution.size(); ++i) handles[i] = handle(solution[i].vertex);
      return handles;
    }));
  }

  void remove(const Array<std::int32_t>& input) {
    const auto handles = numbers_of(input, "vertices");
    locked(handles.size(), [&](const std::stop_token& stop) {
      std::vector<tri::VertexId> vertices = checked(handles);
      std::vector<std::int32_t> sorted(handles.begin(), handles.end());
      std::sort(sorted.begin(), sorted.end());
      const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
      if (twice != sorted.end()) {
        throw std::invalid_argument("vertex " + std::to_string(*twice) + " is named twice");
      }
      // A stop ends the call between portions of vertices that are close together.
      constexpr std::size_t kPortion = 20'000;
      if (vertices.size() > kPortion) vertices = in_near_order(vertices);
      for (std::size_t at = 0; at < vertices.size() && !stop.stop_requested(); at += kPortion) {
        mesh_.remove(std::span(vertices).subspan(at, std::min(kPortion, vertices.size() - at)));
      }
      Kind::settle(mesh_);
      if (stop.stop_requested()) throw stream::Stopped();
      return 0;
    });
  }

  [[nodiscard]] py::array_t<double> points() {
    return to_array(locked(size_, [&] {
      constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
      Point none;
      none.fill(kNan);
      std::vector<Point> places(mesh_.vertex_slots(), none);
      for (const tri::VertexId v : mesh_.all_vertices()) places[slot(v)] = mesh_.point(v);
      return places;
    }));
  }

  [[nodiscard]] py::array_t<std::int32_t> vertices() {
    return to_array(locked(size_, [&] {
      std::vector<std::int32_t> handles;
      handles.reserve(mesh_.vertex_count());
      for (const tri::VertexId v : mesh_.all_vertices()) handles.push_back(handle(v));
      return handles;
    }));
  }

  [[nodiscard]] py::array_t<std::int32_t> simplices() {
    return to_array(locked(size_, [&] {
      std::vector<Row> rows;
      rows.reserve(Kind::count(mesh_));
      for (const auto s : Kind::all(mesh_)) rows.push_back(row_of(mesh_.vertices(s)));
      return rows;
    }));
  }

  [[nodiscard]] py::array_t<std::int32_t> neighbours() {
    return to_array(locked(size_, [&] {
      const std::vector<std::int32_t> rank = rows_of_simplices();
      std::vector<Row> rows;
      rows.reserve(Kind::count(mesh_));
      for (const auto s : Kind::all(mesh_)) {
        const auto around = mesh_.neighbours(s);
        auto& row = rows.emplace_back();
        for (std::size_t i = 0; i < row.size(); ++i) {
          row[i] = mesh_.alive(around[i]) ? rank[slot(around[i])] : -1;
        }
      }
      return rows;
    }));
  }

  /// Returns compressed rows by vertex number: the offset of each row, and the adjacent vertices.
  [[nodiscard]] py::tuple adjacent() {
    std::vector<std::int32_t> joined;
    auto begins = locked(size_, [&] {
      std::vector<std::int64_t> rows{0};
      std::vector<tri::VertexId> around;
      for (std::uint32_t v = 0; v < mesh_.vertex_slots(); ++v) {
        if (mesh_.alive(tri::VertexId{v})) {
          mesh_.adjacent(tri::VertexId{v}, around);
          for (const tri::VertexId other : around) joined.push_back(handle(other));
        }
        rows.push_back(static_cast<std::int64_t>(joined.size()));
      }
      return rows;
    });
    return py::make_tuple(to_array(std::move(begins)), to_array(std::move(joined)));
  }

  void start_journal() {
    locked(0, [&] {
      mesh_.start_journal();
      recording_ = true;
      return 0;
    });
  }

  /// Returns the changes since start_journal() or the previous call.
  /// Throws: std::invalid_argument unless a journal was started.
  [[nodiscard]] py::dict take_changes() {
    std::vector<std::int32_t> added, removed;
    std::vector<Point> removed_points;
    std::vector<Row> added_rows, removed_rows;
    locked(size_, [&] {
      if (!recording_) throw std::invalid_argument("record() has not been called");
      typename Mesh::Changes changes;
      mesh_.take_changes(changes);
      for (const tri::VertexId v : changes.added_vertices) added.push_back(handle(v));
      for (const tri::VertexId v : changes.removed_vertices) removed.push_back(handle(v));
      removed_points = std::move(changes.removed_points);
      for (const auto s : Kind::added(changes)) added_rows.push_back(row_of(mesh_.vertices(s)));
      for (const auto& corners : changes.removed_corners) {
        removed_rows.push_back(row_of(corners));
      }
      return 0;
    });
    py::dict result;
    result["added_vertices"] = to_array(std::move(added));
    result["removed_vertices"] = to_array(std::move(removed));
    result["removed_points"] = to_array(std::move(removed_points));
    result["added_simplices"] = to_array(std::move(added_rows));
    result["removed_simplices"] = to_array(std::move(removed_rows));
    return result;
  }

  [[nodiscard]] py::array_t<std::int32_t> find_simplex(const Array<double>& input) {
    const auto places = rows_of<N>(input, "points");
    return to_array(locked(places.size() + size_, [&] {
      const std::vector<std::int32_t> rank = rows_of_simplices();
      std::vector<std::int32_t> found(places.size(), -1);
      tri::VertexId hint = tri::kNoVertex;
      for (const std::size_t i : near_order(places)) {
        if (!finite(places[i])) continue;
        const auto s = Kind::found(mesh_, places[i], hint);
        if (mesh_.alive(s)) found[i] = rank[slot(s)];
      }
      return found;
    }));
  }

  [[nodiscard]] py::array_t<std::int32_t> nearest(const Array<double>& input) {
    const auto places = rows_of<N>(input, "points");
    return to_array(locked(places.size(), [&] {
      std::vector<std::int32_t> found(places.size(), -1);
      tri::VertexId last = tri::kNoVertex;
      for (const std::size_t i : near_order(places)) {
        if (!finite(places[i])) continue;
        last = mesh_.nearest(places[i], last);
        if (last != tri::kNoVertex) found[i] = handle(last);
      }
      return found;
    }));
  }

  [[nodiscard]] std::size_t size() {
    return locked(0, [&] { return mesh_.vertex_count(); });
  }
  [[nodiscard]] std::size_t count() {
    return locked(0, [&] { return Kind::count(mesh_); });
  }
  [[nodiscard]] std::uint64_t hash() {
    return locked(size_, [&] { return mesh_.hash(); });
  }

  /// Returns the vertices with the given numbers. Call it only from read() or change().
  /// Throws: std::invalid_argument for a vertex that does not exist.
  std::vector<tri::VertexId> checked(std::span<const std::int32_t> handles) const {
    std::vector<tri::VertexId> vertices;
    vertices.reserve(handles.size());
    for (const std::int32_t number : handles) {
      const tri::VertexId vertex{static_cast<std::uint32_t>(number)};
      if (number < 0 || !mesh_.alive(vertex)) {
        throw std::invalid_argument("there is no vertex " + std::to_string(number));
      }
      vertices.push_back(vertex);
    }
    return vertices;
  }

 private:
  static std::int32_t handle(tri::VertexId vertex) { return static_cast<std::int32_t>(vertex); }
  static Row row_of(const std::array<tri::VertexId, Kind::kCorners>& corners) {
    Row row{};
    std::transform(corners.begin(), corners.end(), row.begin(), handle);
    return row;
  }

  [[nodiscard]] std::vector<tri::VertexId> in_near_order(
      std::span<const tri::VertexId> vertices) const {
    std::vector<Point> places;
    for (const tri::VertexId v : vertices) places.push_back(mesh_.point(v));
    std::vector<tri::VertexId> ordered;
    for (const std::size_t i : near_order(std::span<const Point>(places))) {
      ordered.push_back(vertices[i]);
    }
    return ordered;
  }

  /// Inserts the first points into an empty mesh, which stays empty if this is stopped or fails.
  std::vector<tri::VertexId> build(std::span<const Point> points, const std::stop_token& stop) {
    mesh_.set_check_stop(stop_check(stop));
    try {
      std::vector<tri::VertexId> solution = mesh_.build(points);
      Kind::settle(mesh_);
      mesh_.set_check_stop({});
      return solution;
    } catch (...) {
      if constexpr (requires { mesh_.clear(); }) {
        mesh_.clear();
      } else {
        mesh_ = Mesh();
      }
      mesh_.set_check_stop({});
      throw;
    }
  }

  /// Returns work() or work(stop token) under the mutex. Long work can be interrupted by signals.
  template <class Work>
  auto locked(std::size_t items, Work&& work) {
    constexpr std::size_t kMuch = 10000;
    const auto alone = [&](const std::stop_token& stop) {
      const std::lock_guard lock(mutex_);
      auto result = [&] {
        if constexpr (std::is_invocable_v<Work, const std::stop_token&>) {
          return work(stop);
        } else {
          return work();
        }
      }();
      size_ = mesh_.vertex_count();
      return result;
    };
    if (items > kMuch) return released(alone);
    const py::gil_scoped_release open;
    return alone({});
  }

  /// Returns the row of each simplex in simplices(), by slot.
  std::vector<std::int32_t> rows_of_simplices() const {
    std::vector<std::int32_t> rank(Kind::slots(mesh_), -1);
    std::int32_t next = 0;
    for (const auto s : Kind::all(mesh_)) rank[slot(s)] = next++;
    return rank;
  }

  std::mutex mutex_;
  Mesh mesh_;                          ///< guarded by mutex_
  bool recording_ = false;             ///< likewise
  std::atomic<std::size_t> size_ = 0;  ///< number of vertices after the last piece of work
};

using SharedDelaunay2 = SharedDelaunay<2>;
using SharedDelaunay3 = SharedDelaunay<3>;
using SharedSurface = SharedDelaunay<3, tri::Euclidean, SurfaceKind>;

}  // namespace terrace::python
