// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/store_metric.hpp>
#include <terrace/terrain/store_source.hpp>
#include <terrace/tri/regional_delaunay2.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "mesh_changes.hpp"
#include "names.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

using ClusterPair = std::pair<unsigned, std::uint64_t>;
using FlatBox = std::array<double, 6>;  ///< minima, then maxima in the CRS
using Focuses = std::vector<std::pair<FlatBox, unsigned>>;

py::array_t<std::uint64_t> array_of(const std::vector<tri::ClusterId>& clusters) {
  std::vector<std::array<std::uint64_t, 2>> rows;
  for (const tri::ClusterId of : clusters) rows.push_back({level_of(of), ordinal_of(of)});
  return to_array(std::move(rows));
}

using Tetrahedra = tri::Delaunay3<double, tri::EllipticalMetric3>;
template <class Triangulation>
inline constexpr bool kInSpace = std::is_same_v<Triangulation, Tetrahedra>;

/// The triangulation of a store at mixed levels, which Python's threads may share.
template <class Triangulation>
class SharedModel {
 public:
  using Model = tri::MultiresolutionModel<Triangulation>;

  /// make_empty: returns the triangulation to fill.
  template <class MakeEmpty>
  SharedModel(const stream::Store& store, unsigned level, const Focuses& focuses,
              const MakeEmpty& make_empty)
      : store_(store) {
    const tri::Detail start = detail_of(level, focuses);
    // Ctrl-C ends only this call. Later ones keep the view and its check, which do nothing then.
    released([&](const std::stop_token& stop) {
      store_ = store_.with_stop(stop);
      Triangulation empty = make_empty();
      empty.set_check_stop(stop_check(stop));
      model_ = std::make_unique<Model>(source_, start, tri::ModelOptions{}, std::move(empty));
    });
  }

  /// Applies step(model), which returns its delta.
  template <class Step>
  py::dict change(Step&& step) {
    typename Changes::Change result;
    released([&] {
      const std::lock_guard lock(mutex_);
      result = changes().of(step(*model_));
    });
    return dict_of(std::move(result));
  }
  py::dict snapshot() {
    typename Changes::Change result;
    released([&] {
      const std::lock_guard lock(mutex_);
      result = changes().snapshot();
    });
    return dict_of(std::move(result));
  }
  template <class Question>
  auto ask(Question&& question) {
    const py::gil_scoped_release open;
    const std::lock_guard lock(mutex_);
    return question(*model_);
  }

  [[nodiscard]] tri::ClusterId cluster(const ClusterPair& pair) const {
    return cluster_of(store_, pair.first, pair.second);
  }
  [[nodiscard]] tri::Detail detail_of(unsigned level, const Focuses& focuses) const {
    tri::Detail detail{.level = level, .focuses = {}};
    for (const auto& [box, fine] : focuses) detail.focuses.push_back({stored(box), fine});
    return detail;
  }
  /// Returns the stored box around a box in the CRS; triangles ignore its heights.
  [[nodiscard]] tri::Box3 stored(const FlatBox& box) const {
    const tri::Box3 around =
        stored_box(store_.schema(), {{box[0], box[1], box[2]}, {box[3], box[4], box[5]}});
    if (kInSpace<Triangulation>) return around;
    return tri::box2(around.min[0], around.min[1], around.max[0], around.max[1]);
  }
  /// Returns (box, error, members).
  py::tuple record(const ClusterPair& pair) {
    const tri::ClusterId id = cluster(pair);
    const tri::ClusterRecord of = ask([&](Model& model) {
      if (!model.is_expanded(id) && !model.can_expand(id)) {
        throw std::invalid_argument(to_string(id) + " is not directly below an expanded cluster");
      }
      return model.record(id);
    });
    const stream::Box3 box = world_box(store_.schema(), of.box);
    return py::make_tuple(
        py::make_tuple(box.min[0], box.min[1], box.min[2], box.max[0], box.max[1], box.max[2]),
        of.error, of.members);
  }

 private:
  using Changes = MeshChanges<Triangulation, std::function<stream::Point3(tri::VertexId)>>;

  [[nodiscard]] Changes changes() const {
    const stream::Placement& placement = store_.schema();
    const std::array<double, 6>& m = placement.world.xy;
    bool mirrored = m[0] * m[4] - m[1] * m[3] < 0;
    if (kInSpace<Triangulation>) mirrored ^= placement.coordinates[2].scale < 0;
    return Changes(model_->triangulation(), mirrored, [this](tri::VertexId v) {
      const auto p = model_->triangulation().point(v);
      return world_point(store_.schema(),
                         {static_cast<double>(p[0]), static_cast<double>(p[1]), model_->height(v)});
    });
  }

  stream::Store store_;
  terrain::StoreSource source_{store_};
  std::mutex mutex_;
  std::unique_ptr<Model> model_;
};

template <class Triangulation>
void bind_kind(py::module_& module, const char* name) {
  using Shared = SharedModel<Triangulation>;
  using Model = typename Shared::Model;
  py::class_<Shared>(module, name)
      .def("expand",
           [](Shared& shared, const ClusterPair& pair) {
             const tri::ClusterId id = shared.cluster(pair);
             return shared.change([&](Model & model) -> auto& { return model.expand(id); });
           })
      .def("collapse",
           [](Shared& shared, const ClusterPair& pair) {
             const tri::ClusterId id = shared.cluster(pair);
             return shared.change([&](Model & model) -> auto& { return model.collapse(id); });
           })
      .def("set_region",
           [](Shared& shared, const FlatBox& box, unsigned level, bool refine, bool coarsen) {
             const tri::Box3 region = shared.stored(box);
             return shared.change([&](Model & model) -> auto& {
               if (!coarsen) return model.refine(region, level);
               return refine ? model.set_region(region, level) : model.coarsen(region, level);
             });
           })
      .def("set_detail",
           [](Shared& shared, unsigned level, const Focuses& focuses) {
             const tri::Detail detail = shared.detail_of(level, focuses);
             return shared.change([&](Model & model) -> auto& { return model.set_detail(detail); });
           })
      .def("snapshot", &Shared::snapshot)
      .def("record", &Shared::record)
      .def("expanded",
           [](Shared& shared) {
             return array_of(shared.ask([](Model& model) { return model.expanded(); }));
           })
      .def("children",
           [](Shared& shared, const ClusterPair& pair) {
             const tri::ClusterId id = shared.cluster(pair);
             return array_of(shared.ask([&](Model& model) {
               std::vector<tri::ClusterId> below;
               model.children(id, below);
               return below;
             }));
           })
      .def("levels",
           [](Shared& shared) {
             return to_array(shared.ask([](Model& model) {
               std::vector<std::uint8_t> levels;
               for (const tri::VertexId v : model.triangulation().all_vertices()) {
                 levels.push_back(static_cast<std::uint8_t>(model.level(v)));
               }
               return levels;
             }));
           })
      .def("count", [](Shared& shared) {
        return shared.ask([](Model& model) {
          const auto& cells = model.triangulation();
          if constexpr (kInSpace<Triangulation>) {
            return std::pair(model.point_count(), cells.tetrahedron_count());
          } else {
            return std::pair(model.point_count(), cells.triangle_count());
          }
        });
      });
}

/// Returns a model; a metric other than euclidean excludes a volume.
py::object model(const OpenStore& open, unsigned level, const Focuses& focuses,
                 const std::string& kind_name, const std::string& metric_name) {
  const stream::Store store = open.get_whole();
  const auto make = [&]<class MakeEmpty>(const MakeEmpty& make_empty) -> py::object {
    using Triangulation = decltype(make_empty());
    return py::cast(
        std::make_unique<SharedModel<Triangulation>>(store, level, focuses, make_empty));
  };
  const auto kind = named<ModelKind>(kind_name);
  const auto metric = terrain::MetricChoice::parse(metric_name);
  const bool regional = metric.kind != terrain::MetricChoice::Kind::euclidean;
  if (kind == ModelKind::volume) {
    if (regional) throw py::value_error("`metric` is for meshes, not for volumes");
    return make([&] { return Tetrahedra(terrain::ground_map(store)); });
  }
  const bool raster = store.schema().grid;
  if (!regional) {
    return raster ? make([] { return tri::Delaunay2<std::int32_t>(); })
                  : make([] { return tri::Delaunay2<double>(); });
  }
  const tri::MetricField2 field = metric_field(metric, store);
  return raster ? make([&] { return tri::RegionalDelaunay2<std::int32_t>(field); })
                : make([&] { return tri::RegionalDelaunay2<double>(field); });
}

}  // namespace

void bind_model(py::module_& module) {
  bind_kind<tri::Delaunay2<std::int32_t>>(module, "GridModel");
  bind_kind<tri::Delaunay2<double>>(module, "PointModel");
  bind_kind<tri::RegionalDelaunay2<std::int32_t>>(module, "GridMetricModel");
  bind_kind<tri::RegionalDelaunay2<double>>(module, "PointMetricModel");
  bind_kind<Tetrahedra>(module, "VolumeModel");
  module.def("model", &model);
}

}  // namespace terrace::python
