// SPDX-License-Identifier: Apache-2.0
#include "store.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/near_points.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

/// The number of points on each level and above, the mean height, and the bounding box.
struct PointStatistics {
  std::vector<std::uint64_t> points;
  double mean_height = 0.0;
  stream::Box3 bounds;
};

PointStatistics statistics_of(const stream::Store& store) {
  PointStatistics statistics;
  if (store.condition() == nullptr) {
    for (const stream::LevelInfo& level : store.levels()) statistics.points.push_back(level.points);
    statistics.mean_height = store.mean_height();
    statistics.bounds = store.bounds();
    return statistics;
  }
  statistics.points.resize(store.top() + 1);
  double sum = 0.0;
  std::uint64_t points = 0;
  for (unsigned level = store.top() + 1; level-- > 0;) {
    store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                              const stream::ClusterPoints& of) {
      for (std::size_t i = 0; i < of.size(); ++i) {
        if (!of.match(i)) continue;
        ++points;
        sum += of.positions[i][2];
        statistics.bounds.include(of.positions[i]);
      }
    });
    statistics.points[level] = points;
  }
  statistics.mean_height = sum / static_cast<double>(points);
  return statistics;
}

py::dict info_of(const OpenStore& open) {
  const stream::Store store = open.get();
  const stream::StoreSchema& schema = store.schema();
  const PointStatistics statistics = released([&] { return statistics_of(store); });
  const stream::Box3 box = world_box(schema, statistics.bounds);
  py::dict info;
  info["path"] = text_of(store.path().string());
  info["points"] = statistics.points.front();
  info["bytes"] = store.bytes();
  info["format"] = schema.format;
  info["grid"] = schema.grid;
  info["columns"] = schema.columns;
  info["rows"] = schema.rows;
  info["nodata"] = schema.nodata;
  info["bounds"] =
      py::make_tuple(box.min[0], box.min[1], box.min[2], box.max[0], box.max[1], box.max[2]);
  const stream::Channel& z = schema.coordinates[2];
  info["mean_height"] = statistics.mean_height * z.scale + z.offset;
  info["vertical"] = schema.vertical;
  info["transform"] = py::cast(schema.world.xy);
  info["crs"] = crs_info(schema.crs);
  info["attributes"] = attributes_info(schema);
  info["top"] = store.top();
  py::list levels;
  for (const stream::LevelInfo& of : store.levels()) {
    py::dict level;
    level["level"] = of.level;
    level["points"] = statistics.points[of.level];
    level["clusters"] = of.clusters;
    level["bytes"] = of.bytes;
    level["segments"] = of.segments;
    levels.append(level);
  }
  info["levels"] = levels;
  info["parameters"] = py::cast(schema.parameters);
  info["checksum"] = store.checksum();
  info["surface"] = py::none();
  if (const auto surface = store.surface()) {
    py::dict size;
    size["vertices"] = surface->vertices;
    size["triangles"] = surface->triangles;
    size["bytes"] = surface->bytes;
    info["surface"] = size;
  }
  return info;
}

/// Appends numbers and bytes to packed records.
void append(std::vector<std::byte>& to, std::span<const double> numbers,
            std::span<const std::byte> bytes) {
  const auto begin = std::as_bytes(numbers);
  to.insert(to.end(), begin.begin(), begin.end());
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// Appends the wanted points of some clusters to packed records.
class RecordsPart final : public terrain::WantedPart {
 public:
  /// to: the conversion of places, or null.
  RecordsPart(const terrain::WantedPoints& wanted, std::size_t payload,
              const terrain::Transformation* to, std::vector<std::byte>& all)
      : wanted_(wanted), payload_(payload), to_(to), all_(all) {}

  void add(stream::ClusterId, const stream::ClusterRecord& record,
           const stream::ClusterPoints& points) override {
    wanted_(record, points, [&](std::size_t i, stream::Point3 p) {
      if (to_ != nullptr) {
        terrain::Point2 there{p[0], p[1]};
        to_->forward({&there, 1});
        p = {there[0], there[1], p[2]};
      }
      append(part_, p, std::span(points.payload).subspan(i * payload_, payload_));
    });
  }
  void take() override { all_.insert(all_.end(), part_.begin(), part_.end()); }

 private:
  const terrain::WantedPoints& wanted_;
  std::size_t payload_;
  const terrain::Transformation* to_;
  std::vector<std::byte>& all_;
  std::vector<std::byte> part_;
};

py::array points(const OpenStore& open, unsigned level, const py::object& region,
                 const py::list& focuses, const std::string& where,
                 std::optional<std::pair<unsigned, std::uint64_t>> cluster, const std::string& crs,
                 const py::tuple& settings) {
  const stream::Store store = open.get(where);
  terrain::Detail detail = detail_of(store, level, region, focuses);
  if (cluster) detail.cluster = cluster_of(store, cluster->first, cluster->second);
  const std::size_t payload = store.schema().payload_size();
  std::vector<std::byte> records = Call(settings).run([&](const terrain::Context& context) {
    const auto to = change_to(store, crs);
    note_idle_focuses(store, detail, context);
    std::vector<std::byte> bytes;
    // The size is known in advance if all points are wanted.
    if (!detail.region && detail.focuses.empty() && !detail.cluster && where.empty()) {
      bytes.reserve(store.levels()[level].points * (sizeof(stream::Point3) + payload));
    }
    const stream::Store stoppable = store.with_stop(context.stop);
    const terrain::WantedPoints wanted(stoppable, detail);
    for_each_wanted(stoppable, detail, context.threads, [&](unsigned) {
      return std::make_unique<RecordsPart>(wanted, payload, to ? &*to : nullptr, bytes);
    });
    return bytes;
  });
  return to_records(std::move(records), record_type(store.schema()));
}

/// Returns a row for each cluster of a level: the box in the CRS, error, descendants, members.
py::array clusters(const OpenStore& open, unsigned level, const py::tuple& settings) {
  const stream::Store store = open.get();
  if (level > store.top()) throw py::value_error("the store has no level " + std::to_string(level));
  return to_array(Call(settings).run([&](const terrain::Context& context) {
    std::vector<std::array<double, 9>> rows;
    const std::uint64_t count = store.levels()[level].clusters;
    rows.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      context.check_stop();
      const stream::ClusterRecord of = store.record(stream::cluster_id(level, i));
      const stream::Box3 box = world_box(store.schema(), of.summary.box);
      rows.push_back({box.min[0], box.min[1], box.min[2], box.max[0], box.max[1], box.max[2],
                      of.summary.error, static_cast<double>(of.summary.descendants),
                      static_cast<double>(of.points)});
    }
    return rows;
  }));
}

/// Returns the records of found points, each with its distance at the end.
std::vector<std::byte> records_of(const stream::StoreQuery& query,
                                  const std::vector<stream::FoundPoint>& found) {
  const stream::StoreSchema& schema = query.store().schema();
  const std::size_t payload = schema.payload_size();
  const std::vector<std::byte> attributes = query.attributes(found);
  std::vector<std::byte> bytes;
  bytes.reserve(found.size() * (sizeof(stream::Point3) + payload + sizeof(double)));
  for (std::size_t i = 0; i < found.size(); ++i) {
    append(bytes, world_point(schema, found[i].position),
           std::span(attributes).subspan(i * payload, payload));
    const auto distance = std::as_bytes(std::span(&found[i].distance, 1));
    bytes.insert(bytes.end(), distance.begin(), distance.end());
  }
  return bytes;
}

py::array near(const OpenStore& open, const std::vector<double>& place,
               std::optional<std::size_t> count, std::optional<double> radius, unsigned level,
               const std::string& where) {
  const stream::Store store = open.get(where);
  if (place.size() != 2 && place.size() != 3)
    throw py::value_error("`near` must be two or three numbers");
  terrain::NearPlace wanted{.xy = {place[0], place[1]}};
  if (place.size() == 3) wanted.z = place[2];
  std::vector<std::byte> records = released([&](std::stop_token stop) {
    const stream::Store heard = store.with_stop(std::move(stop));
    stream::StoreQuery query(heard);
    return records_of(query, count ? nearest_points(query, wanted, *count, level)
                                   : points_within(query, wanted, radius.value(), level));
  });
  return to_records(std::move(records), record_type(store.schema(), {"distance"}));
}

/// Returns a region's box in the store, or several side by side where it crosses the antimeridian.
std::vector<stream::Box3> boxes_of(const terrain::Region& region) {
  std::vector<std::array<double, 2>> spans;
  for (const terrain::Polygon& polygon : region.polygons()) {
    const auto [west, east] = std::minmax_element(polygon[0].begin(), polygon[0].end());
    spans.push_back({(*west)[0], (*east)[0]});
  }
  if (spans.empty()) return {region.box()};
  std::sort(spans.begin(), spans.end());
  std::vector<stream::Box3> boxes;
  for (const auto& [west, east] : spans) {
    if (!boxes.empty() && west <= boxes.back().max[0]) {
      boxes.back().max[0] = std::max(boxes.back().max[0], east);
      continue;
    }
    boxes.push_back(region.box());
    boxes.back().min[0] = west;
    boxes.back().max[0] = east;
  }
  return boxes;
}

}  // namespace

terrain::Detail detail_of(const stream::Store& store, unsigned level, const py::object& region,
                          const py::list& focuses) {
  const auto check = [&](unsigned wanted) {
    if (wanted <= store.top()) return;
    throw py::value_error("the store has no level " + std::to_string(wanted) +
                          ": its top is level " + std::to_string(store.top()));
  };
  terrain::Detail detail;
  check(level);
  detail.level = level;
  detail.region = region_of(region, store);
  for (const py::handle focus : focuses) {
    const auto pair = focus.cast<py::tuple>();
    detail.focuses.push_back({region_of(pair[0], store).value(), pair[1].cast<unsigned>()});
    check(detail.focuses.back().level);
  }
  return detail;
}

tri::ClusterId cluster_of(const stream::Store& store, unsigned level, std::uint64_t number) {
  if (level > store.top() || number >= store.levels()[level].clusters) {
    throw py::value_error("the store has no cluster " + std::to_string(number) + " on level " +
                          std::to_string(level));
  }
  return tri::cluster_id(level, number);
}

stream::Point3 stored_point(const stream::Schema& schema, const stream::Point3& world) {
  const std::array<double, 2> xy = stored_place(schema, {world[0], world[1]});
  const stream::Channel& z = schema.coordinates[2];
  return {xy[0], xy[1], (world[2] - z.offset) / z.scale};
}

stream::Box3 stored_box(const stream::Schema& schema, const stream::Box3& world) {
  stream::Box3 stored;
  for (unsigned corner = 0; corner < 8; ++corner) {
    stream::Point3 p;
    for (unsigned axis = 0; axis < 3; ++axis) {
      p[axis] = (corner >> axis & 1) != 0 ? world.max[axis] : world.min[axis];
    }
    stored.include(stored_point(schema, p));
  }
  return stored;
}

std::string text_of(const stream::Problem& problem) {
  return problem.file + ": byte " + std::to_string(problem.offset) + ": " + problem.what;
}

std::optional<terrain::Transformation> change_to(const stream::Store& store,
                                                 const std::string& crs) {
  if (crs.empty()) return std::nullopt;
  return terrain::transformation_to(store, crs);
}

void bind_store(py::module_& module) {
  py::class_<OpenStore>(module, "OpenStore")
      .def(py::init<const std::string&>(), py::call_guard<py::gil_scoped_release>())
      .def("close", &OpenStore::close)
      .def("closed", &OpenStore::closed)
      .def("where",
           [](const OpenStore& open, const std::string& condition) {
             const stream::Store view = open.get(condition);
             // Throws if no point meets the condition.
             released([&](const std::stop_token& stop) { return view.with_stop(stop).bounds(); });
             return OpenStore(view);
           })
      .def("info", &info_of)
      .def("points", &points)
      .def("near", &near)
      .def("clusters", &clusters)
      .def("count",
           [](const OpenStore& open, const py::object& argument) {
             const stream::Store store = open.get();
             const std::array<double, 6>& xy = store.schema().world.xy;
             if (xy[1] != 0 || xy[3] != 0)
               throw py::value_error(
                   "the raster is rotated: boxes do not follow its columns and rows");
             const terrain::Region region = region_of(argument, store).value();
             return released([&](const std::stop_token& stop) {
               const stream::Store stoppable = store.with_stop(stop);
               std::uint64_t points = 0;
               for (const stream::Box3& box : boxes_of(region)) {
                 points += stream::StoreQuery(stoppable).count(stored_box(store.schema(), box));
               }
               return points;
             });
           })
      .def("verify", [](const OpenStore& open, const py::tuple& settings) {
        const stream::Store store = open.get();
        return Call(settings).run([&](const terrain::Context& context) {
          std::vector<std::string> faults;
          store.with_stop(context.stop)
              .verify([&](const stream::Problem& problem) { faults.push_back(text_of(problem)); },
                      context.threads);
          return faults;
        });
      });
}

}  // namespace terrace::python
