// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/store_view.hpp>
#include <unistd.h>

#include "arrays.hpp"
#include "call.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

/// What came and went, as arrays.
struct ViewChange {
  std::vector<std::int32_t> added_vertices, removed_vertices, moved_vertices;
  std::vector<stream::Point3> added_positions, moved_positions;
  std::vector<std::int32_t> added_triangles, removed_triangles;
  std::vector<std::array<std::int32_t, 3>> added_corners;
  std::size_t expanded = 0, collapsed = 0, missing = 0, pending = 0, points = 0;
  bool settled = false;
};

py::dict dict_of(ViewChange&& change) {
  py::dict result;
  result["added_vertices"] = to_array(std::move(change.added_vertices));
  result["added_positions"] = to_array(std::move(change.added_positions));
  result["removed_vertices"] = to_array(std::move(change.removed_vertices));
  result["moved_vertices"] = to_array(std::move(change.moved_vertices));
  result["moved_positions"] = to_array(std::move(change.moved_positions));
  result["added_triangles"] = to_array(std::move(change.added_triangles));
  result["added_corners"] = to_array(std::move(change.added_corners));
  result["removed_triangles"] = to_array(std::move(change.removed_triangles));
  result["expanded"] = change.expanded;
  result["collapsed"] = change.collapsed;
  result["missing"] = change.missing;
  result["pending"] = change.pending;
  result["points"] = change.points;
  result["settled"] = change.settled;
  return result;
}

class AnyView {
 public:
  virtual ~AnyView() = default;
  virtual ViewChange frame(const tri::View& view, double seconds) = 0;
  /// Everything there is, as added.
  virtual ViewChange whole() = 0;
  virtual terrain::ViewTraffic traffic() = 0;
};

template <class Shown>
class ViewOf final : public AnyView {
 public:
  using StoreView = terrain::StoreView<Shown>;
  static constexpr bool kTriangles = !std::is_same_v<Shown, tri::PointCloud>;

  ViewOf(const stream::Store& store, const tri::ViewOptions& options, bool reads_in_frame)
      : view_(store, options,
              reads_in_frame ? StoreView::Reader::in_frame : StoreView::Reader::thread) {}

  ViewChange frame(const tri::View& wish, double seconds) override {
    const auto& step = view_.frame(wish, seconds);
    ViewChange change;
    const auto& changes = step.delta->changes;
    for (const tri::VertexId v : changes.removed_vertices) change.removed_vertices.push_back(id(v));
    for (const tri::VertexId v : changes.added_vertices) add(change, v);
    for (const tri::VertexId v : step.delta->reassigned) {
      change.moved_vertices.push_back(id(v));
      change.moved_positions.push_back(view_.in_view_frame(v));
    }
    if constexpr (kTriangles) {
      for (const auto t : changes.removed_triangles) change.removed_triangles.push_back(id(t));
      for (const auto t : changes.added_triangles) add(change, t);
    }
    change.expanded = step.expanded;
    change.collapsed = step.collapsed;
    change.missing = step.missing;
    change.pending = step.pending;
    describe(change);
    return change;
  }

  ViewChange whole() override {
    ViewChange change;
    const auto& shown = view_.model().triangulation();
    for (const tri::VertexId v : shown.all_vertices()) add(change, v);
    if constexpr (kTriangles) {
      for (const auto t : shown.all_triangles()) add(change, t);
    }
    describe(change);
    return change;
  }

  terrain::ViewTraffic traffic() override { return view_.traffic(); }

 private:
  template <class Id>
  static std::int32_t id(Id of) {
    return static_cast<std::int32_t>(tri::slot(of));
  }
  void add(ViewChange& change, tri::VertexId v) const {
    change.added_vertices.push_back(id(v));
    change.added_positions.push_back(view_.in_view_frame(v));
  }
  void add(ViewChange& change, tri::TriangleId t) const {
    if constexpr (kTriangles) {
      const auto corners = view_.model().triangulation().vertices(t);
      change.added_triangles.push_back(id(t));
      change.added_corners.push_back({id(corners[0]), id(corners[1]), id(corners[2])});
    }
  }
  void describe(ViewChange& change) const {
    change.settled = view_.settled();
    change.points = view_.model().point_count();
  }

  StoreView view_;
};

/// A view that Python's threads may share, and that a fork of the process may not use.
class SharedView {
 public:
  SharedView(const OpenStore& open, bool points, bool reads_in_frame, std::size_t max_points)
      : process_(getpid()), store_(open.get()) {
    tri::ViewOptions options;
    options.max_points = max_points;
    const py::gil_scoped_release released;
    if (points) {
      view_ = std::make_unique<ViewOf<tri::PointCloud>>(store_, options, reads_in_frame);
    } else if (store_.schema().grid) {
      view_ = std::make_unique<ViewOf<std::int32_t>>(store_, options, reads_in_frame);
    } else {
      view_ = std::make_unique<ViewOf<double>>(store_, options, reads_in_frame);
    }
  }
  ~SharedView() {
    // Its thread is not there to be waited for.
    if (getpid() != process_) static_cast<void>(view_.release());
  }
  SharedView(const SharedView&) = delete;
  SharedView& operator=(const SharedView&) = delete;

 private:
  template <class Work>
  auto locked(Work&& work) {
    if (getpid() != process_) {
      throw py::value_error("a view is not there after a fork: make one in this process");
    }
    const py::gil_scoped_release released;
    const std::lock_guard lock(mutex_);
    return work();
  }

 public:
  py::dict frame(const tri::View& wish, double seconds) {
    return dict_of(locked([&] { return view_->frame(wish, seconds); }));
  }
  py::dict whole() {
    return dict_of(locked([&] { return view_->whole(); }));
  }
  py::tuple traffic() {
    const terrain::ViewTraffic read = locked([&] { return view_->traffic(); });
    return py::make_tuple(read.clusters, read.points, read.bytes);
  }

 private:
  pid_t process_;
  stream::Store store_;
  std::mutex mutex_;
  std::unique_ptr<AnyView> view_;
};

tri::Point3 point_of(const py::object& given, const char* what) {
  const auto array = given.cast<Array<double>>();
  const auto numbers = numbers_of(array, what);
  if (numbers.size() != 3) throw py::value_error(std::string(what) + " has three numbers");
  return {numbers[0], numbers[1], numbers[2]};
}

tri::View view_of(const py::dict& given) {
  const auto number = [&](const char* name) { return given[name].cast<double>(); };
  tri::View view;
  view.pixel_error = number("pixel_error");
  view.ground_error = number("ground_error");
  if (!given["matrix"].is_none()) {
    const auto array = given["matrix"].cast<Array<double>>();
    const auto rows = rows_of<4>(array, "matrix");
    if (rows.size() != 4) throw py::value_error("matrix must have the shape (4, 4)");
    std::array<double, 16> matrix{};
    std::copy_n(array.data(), 16, matrix.begin());
    view.camera = tri::matrix_camera(matrix, number("height"));
  } else if (!given["position"].is_none()) {
    const tri::Pose pose{point_of(given["position"], "position"),
                         point_of(given["direction"], "direction"), point_of(given["up"], "up")};
    view.camera = tri::perspective_camera(pose, number("fov"), number("width") / number("height"),
                                          number("height"));
  }
  return view;
}

}  // namespace

void bind_view(py::module_& module) {
  py::class_<SharedView>(module, "SharedView")
      .def(py::init<const OpenStore&, bool, bool, std::size_t>())
      .def("frame", [](SharedView& view, const py::dict& wish,
                       double seconds) { return view.frame(view_of(wish), seconds); })
      .def("whole", &SharedView::whole)
      .def("traffic", &SharedView::traffic);
}

}  // namespace terrace::python
