// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/store_metric.hpp>
#include <terrace/terrain/store_view.hpp>
#include <terrace/terrain/surface_view.hpp>
#include <unistd.h>

#include "arrays.hpp"
#include "call.hpp"
#include "mesh_changes.hpp"
#include "names.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

/// The changes made by a frame.
struct ViewChange : MeshChange {
  std::size_t expanded = 0, collapsed = 0, missing = 0, pending = 0, points = 0;
  bool settled = false;
};

py::dict dict_of_view(ViewChange&& change) {
  py::dict result = dict_of(static_cast<MeshChange&&>(change));
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
  /// Returns the whole model as a change that adds it.
  virtual ViewChange snapshot() = 0;
  virtual terrain::ViewTraffic traffic() = 0;
  virtual ViewChange restore(unsigned threads) = 0;
  /// Pins a cluster, or unpins it if `pin` is empty.
  virtual void pin(tri::ClusterId cluster, std::optional<tri::ViewPin> pin) = 0;
  /// Returns records of the store's schema. Throws: std::invalid_argument for a vertex that does
  /// not exist or whose attributes were dropped.
  virtual std::vector<std::byte> attributes(std::span<const std::int32_t> vertices) = 0;
  /// Converts points from stored coordinates to metres east, north and up.
  virtual void to_metres(std::span<stream::Point3> points) = 0;
};

/// Implements AnyView::attributes(). shown: what has the vertices.
template <class View, class Shown>
std::vector<std::byte> records_of(const View& view, const Shown& shown,
                                  std::span<const std::int32_t> vertices) {
  std::vector<std::byte> records;
  for (const std::int32_t number : vertices) {
    const tri::VertexId vertex{static_cast<std::uint32_t>(number)};
    if (number < 0 || !shown.alive(vertex)) {
      throw std::invalid_argument("there is no vertex " + std::to_string(number));
    }
    const auto record = view.attributes(vertex);
    if (record.empty()) {
      throw std::invalid_argument("the attributes of vertex " + std::to_string(number) +
                                  " were dropped: read them right after the frame that adds it");
    }
    records.insert(records.end(), record.begin(), record.end());
  }
  return records;
}

template <class Shown>
class ViewOf final : public AnyView {
 public:
  using StoreView = terrain::StoreView<Shown>;
  ViewOf(const stream::Store& store, const tri::ViewOptions& options, bool reads_in_frame,
         terrain::ViewMetrics<Shown> metrics = {})
      : view_(store, options,
              reads_in_frame ? StoreView::Reader::in_frame : StoreView::Reader::thread,
              std::move(metrics)) {}

  ViewChange frame(const tri::View& wish, double seconds) override {
    const auto& step = view_.frame(wish, seconds);
    ViewChange change = described(changes().of(*step.delta));
    change.expanded = step.expanded;
    change.collapsed = step.collapsed;
    change.missing = step.missing;
    change.pending = step.pending;
    return change;
  }
  ViewChange snapshot() override { return described(changes().snapshot()); }
  terrain::ViewTraffic traffic() override { return view_.traffic(); }
  ViewChange restore(unsigned threads) override {
    return described(changes().of(view_.restore(threads)));
  }
  void pin(tri::ClusterId cluster, std::optional<tri::ViewPin> pin) override {
    pin ? view_.pin(cluster, *pin) : view_.unpin(cluster);
  }
  std::vector<std::byte> attributes(std::span<const std::int32_t> vertices) override {
    return records_of(view_, view_.model().triangulation(), vertices);
  }
  void to_metres(std::span<stream::Point3> points) override {
    for (stream::Point3& p : points) p = view_.in_view_frame(p);
  }

 private:
  auto changes() const {
    // The vertices of a scan's surface are already in the view frame.
    const stream::LinearMap& m = view_.ground();
    constexpr bool kSurface = std::is_same_v<Shown, tri::DynamicSurface<std::int32_t>>;
    const bool mirrored = !kSurface && m[0] * m[4] - m[1] * m[3] < 0;
    return MeshChanges<typename terrain::ViewTriangulation<Shown>::type,
                       std::function<stream::Point3(tri::VertexId)>>(
        view_.model().triangulation(), mirrored,
        [this](tri::VertexId v) { return view_.in_view_frame(v); });
  }
  ViewChange described(MeshChange&& result) const {
    ViewChange change{std::move(result)};
    change.settled = view_.settled();
    change.points = view_.points();
    return change;
  }

  StoreView view_;
};

/// A view of the surface that is stored with a scan.
class ViewOfStoredSurface final : public AnyView {
 public:
  ViewOfStoredSurface(const stream::Store& store, const tri::ViewOptions& options)
      : points_(store.points()),
        bytes_(store.surface()->bytes),
        clusters_(0),
        view_(store, options) {
    for (const stream::LevelInfo& level : store.levels()) {
      clusters_ += level.clusters;
      bytes_ += level.bytes;
    }
  }

 private:
  auto changes() const {
    return MeshChanges<tri::SurfaceFront, std::function<stream::Point3(tri::VertexId)>>(
        view_.surface(), false, [this](tri::VertexId v) { return view_.in_view_frame(v); });
  }

 public:
  ViewChange frame(const tri::View& wish, double seconds) override {
    const auto& step = view_.frame(wish, seconds);
    ViewChange change = described(changes().of(*step.changes));
    change.pending = step.pending;
    return change;
  }
  ViewChange snapshot() override { return described(changes().snapshot()); }
  /// All of the store, which was read at once.
  terrain::ViewTraffic traffic() override { return {clusters_, points_, bytes_}; }
  /// The surface is never updated only locally.
  ViewChange restore(unsigned) override { return described({}); }
  void pin(tri::ClusterId cluster, std::optional<tri::ViewPin> pin) override {
    pin ? view_.pin(cluster, *pin) : view_.unpin(cluster);
  }
  std::vector<std::byte> attributes(std::span<const std::int32_t> vertices) override {
    return records_of(view_, view_.surface(), vertices);
  }
  void to_metres(std::span<stream::Point3> points) override {
    for (stream::Point3& p : points) p = view_.in_view_frame(p);
  }

 private:
  ViewChange described(MeshChange&& result) const {
    ViewChange change{std::move(result)};
    change.settled = view_.settled();
    change.points = view_.surface().vertex_count();
    return change;
  }

  std::uint64_t points_, bytes_, clusters_;
  terrain::SurfaceView view_;
};

/// A view that Python's threads may share, but a fork of the process may not use.
class SharedView {
 public:
  SharedView(const OpenStore& open, const std::string& kind_name, const std::string& reader_name,
             const std::string& metric_name, const py::dict& arguments)
      : process_(getpid()), store_(open.get_whole()) {
    tri::ViewOptions options;
    take_option(arguments, "max_points", options.max_points);
    take_option(arguments, "max_bytes", options.max_cached_bytes);
    take_option(arguments, "collapse_below", options.collapse_below);
    take_option(arguments, "guard", options.guard);
    take_option(arguments, "silhouette", options.silhouette);
    // Outlines are not told apart on a stored surface.
    const bool stored = arguments["stored"].cast<bool>() && options.silhouette == 1.0;
    const auto kind = named<ViewKind>(kind_name);
    const bool reads_in_frame = named<ViewReader>(reader_name) == ViewReader::frame;
    const auto metric = terrain::MetricChoice::parse(metric_name);
    const bool regional = metric.kind != terrain::MetricChoice::Kind::euclidean;
    if (regional && kind != ViewKind::mesh) {
      throw py::value_error(
          "`metric` is for the kind mesh: points have no triangles, and those of "
          "a surface are in space");
    }
    const py::gil_scoped_release released;
    if (kind == ViewKind::points) {
      view_ = std::make_unique<ViewOf<tri::PointCloud>>(store_, options, reads_in_frame);
    } else if (kind == ViewKind::surface && stored && terrain::SurfaceView::serves(store_)) {
      view_ = std::make_unique<ViewOfStoredSurface>(store_, options);
    } else if (kind == ViewKind::surface) {
      using Surface = tri::DynamicSurface<std::int32_t>;
      view_ = std::make_unique<ViewOf<Surface>>(store_, options, reads_in_frame);
    } else if (regional) {
      store_.schema().grid ? open_regional<std::int32_t>(options, reads_in_frame, metric)
                           : open_regional<double>(options, reads_in_frame, metric);
    } else if (store_.schema().grid) {
      view_ = std::make_unique<ViewOf<tri::ThinnedDelaunay2>>(store_, options, reads_in_frame);
    } else {
      view_ = std::make_unique<ViewOf<double>>(store_, options, reads_in_frame);
    }
  }
  ~SharedView() {
    // In a fork the view's thread does not exist, so the destructor would wait forever.
    if (getpid() != process_) static_cast<void>(view_.release());
  }
  SharedView(const SharedView&) = delete;
  SharedView& operator=(const SharedView&) = delete;

 private:
  template <class Coord>
  void open_regional(const tri::ViewOptions& options, bool reads_in_frame,
                     const terrain::MetricChoice& metric) {
    using Shown = tri::RegionalDelaunay2<Coord>;
    view_ = std::make_unique<ViewOf<Shown>>(
        store_, options, reads_in_frame, terrain::ViewMetrics<Shown>{metric_field(metric, store_)});
  }
  template <class Work>
  auto locked(Work&& work) {
    if (getpid() != process_) {
      throw py::value_error("a view cannot be used after a fork: make one in this process");
    }
    const py::gil_scoped_release released;
    const std::lock_guard lock(mutex_);
    return work();
  }

 public:
  py::dict frame(const tri::View& wish, double seconds) {
    return dict_of_view(locked([&] { return view_->frame(wish, seconds); }));
  }
  py::dict snapshot() {
    return dict_of_view(locked([&] { return view_->snapshot(); }));
  }
  py::tuple traffic() {
    const terrain::ViewTraffic read = locked([&] { return view_->traffic(); });
    return py::make_tuple(read.clusters, read.points, read.bytes);
  }
  py::dict restore(unsigned threads) {
    return dict_of_view(locked([&] { return view_->restore(threads); }));
  }
  void pin(unsigned level, std::uint64_t number, std::optional<bool> expanded) {
    const tri::ClusterId cluster = cluster_of(store_, level, number);
    std::optional<tri::ViewPin> pin;
    if (expanded) pin = *expanded ? tri::ViewPin::expanded : tri::ViewPin::collapsed;
    locked([&] { view_->pin(cluster, pin); });
  }
  py::array attributes(const Array<std::int32_t>& arguments) {
    const auto vertices = numbers_of(arguments, "vertices");
    const py::dtype type = attributes_type(store_.schema());
    if (type.itemsize() == 0) throw py::value_error("the store's points have no attributes");
    return to_records(locked([&] { return view_->attributes(vertices); }), type);
  }
  py::array to_metres(const Array<double>& arguments) {
    const auto places = rows_of<3>(arguments, "points");
    std::vector<stream::Point3> points;
    for (const stream::Point3& p : places) points.push_back(stored_point(store_.schema(), p));
    locked([&] { view_->to_metres(points); });
    return to_array(std::move(points));
  }

 private:
  pid_t process_;
  stream::Store store_;
  std::mutex mutex_;
  std::unique_ptr<AnyView> view_;
};

tri::Point3 point_of(const py::object& value, const char* what) {
  const auto array = value.cast<Array<double>>();
  const auto numbers = numbers_of(array, what);
  if (numbers.size() != 3) throw py::value_error(std::string(what) + " must be three numbers");
  return {numbers[0], numbers[1], numbers[2]};
}

tri::Box3 box_of(const std::array<double, 6>& box) {
  return {{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
}

tri::View view_of(const py::dict& arguments) {
  const auto number = [&](const char* name) { return arguments[name].cast<double>(); };
  tri::View view;
  view.pixel_error = number("pixel_error");
  view.ground_error = number("ground_error");
  if (!arguments["matrix"].is_none()) {
    const auto array = arguments["matrix"].cast<Array<double>>();
    const auto rows = rows_of<4>(array, "matrix");
    if (rows.size() != 4) throw py::value_error("`matrix` must have the shape (4, 4)");
    std::array<double, 16> matrix{};
    std::copy_n(array.data(), 16, matrix.begin());
    view.camera = tri::matrix_camera(matrix, number("height"));
  } else if (!arguments["position"].is_none()) {
    const tri::Pose pose{point_of(arguments["position"], "position"),
                         point_of(arguments["direction"], "direction"),
                         point_of(arguments["up"], "up")};
    const double aspect = number("width") / number("height");
    view.camera =
        arguments["ground_height"].is_none()
            ? tri::perspective_camera(pose, number("fov"), aspect, number("height"))
            : tri::orthographic_camera(pose, number("ground_height"), aspect, number("height"));
  }
  for (const py::handle focus : arguments["focus"]) {
    const auto [box, level] = focus.cast<std::pair<std::array<double, 6>, unsigned>>();
    view.focuses.push_back({box_of(box), level});
  }
  for (const py::handle region : arguments["regions"]) {
    const auto [box, error] = region.cast<std::pair<std::array<double, 6>, double>>();
    view.regions.push_back({box_of(box), error});
  }
  return view;
}

}  // namespace

void bind_view(py::module_& module) {
  py::class_<SharedView>(module, "SharedView")
      .def(py::init<const OpenStore&, const std::string&, const std::string&, const std::string&,
                    const py::dict&>())
      .def("frame", [](SharedView& view, const py::dict& wish,
                       double seconds) { return view.frame(view_of(wish), seconds); })
      .def("snapshot", &SharedView::snapshot)
      .def("traffic", &SharedView::traffic)
      .def("restore", &SharedView::restore)
      .def("pin", &SharedView::pin)
      .def("attributes", &SharedView::attributes)
      .def("to_metres", &SharedView::to_metres);
}

}  // namespace terrace::python
