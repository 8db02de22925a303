// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/store_source.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "mesh_changes.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

using ClusterPair = std::pair<unsigned, std::uint64_t>;
using FlatBox = std::array<double, 4>;  ///< min x, min y, max x, max y in the CRS

py::array_t<std::uint64_t> array_of(const std::vector<tri::ClusterId>& clusters) {
  std::vector<std::array<std::uint64_t, 2>> rows;
  for (const tri::ClusterId of : clusters) rows.push_back({level_of(of), ordinal_of(of)});
  return to_array(std::move(rows));
}

/// The triangulation of a store at mixed levels, which Python's threads may share.
template <class Coord>
class SharedModel {
 public:
  using Model = tri::Multiresolution2<Coord>;

  SharedModel(const OpenStore& open, unsigned level,
              const std::vector<std::pair<FlatBox, unsigned>>& focuses)
      : store_(open.get_whole()) {
    const tri::Detail start = detail_of(level, focuses);
    // Ctrl-C ends only this call. Later ones keep the view and its check, which do nothing then.
    released([&](const std::stop_token& stop) {
      store_ = store_.with_stop(stop);
      tri::Delaunay2<Coord> empty;
      empty.set_check_stop(stop_check(stop));
      model_ = std::make_unique<Model>(source_, start, tri::ModelOptions{}, std::move(empty));
    });
  }

  /// Applies step(model), which returns its delta.
  template <class Step>
  py::dict change(Step&& step) {
    MeshChange result;
    released([&] {
      const std::lock_guard lock(mutex_);
      result = changes().of(step(*model_));
    });
    return dict_of(std::move(result));
  }
  py::dict snapshot() {
    MeshChange result;
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
  [[nodiscard]] tri::Detail detail_of(
      unsigned level, const std::vector<std::pair<FlatBox, unsigned>>& focuses) const {
    tri::Detail detail{.level = level, .focuses = {}};
    for (const auto& [box, fine] : focuses) detail.focuses.push_back({stored(box), fine});
    return detail;
  }
  /// Returns the stored box around a box in the CRS.
  [[nodiscard]] tri::Box3 stored(const FlatBox& box) const {
    const stream::Box3 flat{{box[0], box[1], 0}, {box[2], box[3], 0}};
    const stream::Box3 around = stored_box(store_.schema(), flat);
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
  auto changes() const {
    const std::array<double, 6>& m = store_.schema().world.xy;
    return MeshChanges<tri::Delaunay2<Coord>, std::function<stream::Point3(tri::VertexId)>>(
        *model_, m[0] * m[4] - m[1] * m[3] < 0, [this](tri::VertexId v) {
          const auto xy = model_->triangulation().point(v);
          return world_point(store_.schema(), {static_cast<double>(xy[0]),
                                               static_cast<double>(xy[1]), model_->height(v)});
        });
  }

  stream::Store store_;
  terrain::StoreSource source_{store_};
  std::mutex mutex_;
  std::unique_ptr<Model> model_;
};

template <class Coord>
void bind_kind(py::module_& module, const char* name) {
  using Shared = SharedModel<Coord>;
  using Model = typename Shared::Model;
  py::class_<Shared>(module, name)
      .def(py::init<const OpenStore&, unsigned, const std::vector<std::pair<FlatBox, unsigned>>&>())
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
           [](Shared& shared, unsigned level,
              const std::vector<std::pair<FlatBox, unsigned>>& focuses) {
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
          return std::pair(model.point_count(), model.triangulation().triangle_count());
        });
      });
}

}  // namespace

void bind_model(py::module_& module) {
  bind_kind<std::int32_t>(module, "GridModel");
  bind_kind<double>(module, "PointModel");
}

}  // namespace terrace::python
