// SPDX-License-Identifier: Apache-2.0
#include "build/clustering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/source.hpp>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

// Regions are boxes in the CRS; the map to the ground may differ between blocks.
void set_metric(const BuildRequest& request, const stream::Placement& info, const Ground& ground,
                cluster::HierarchyOptions& options) {
  const MetricChoice& choice = request.metric;
  if (!choice.has_boxes()) {
    options.metric = choice.on_ground({0, 0, 0}, cluster::kIdentityMap);
    return;
  }
  // Composes two maps: from the CRS to stored coordinates (a raster's columns and rows), and from
  // these to the ground.
  const std::array<double, 6>& xy = info.world.xy;
  const stream::Channel& height = info.coordinates[2];
  options.metric_of = [&choice, &ground, xy, height](const base::Box3& bounds) {
    const GroundMap map = ground.map(bounds);
    const double area = xy[0] * xy[4] - xy[1] * xy[3];
    const auto across = [&](double a, double b) { return (a * xy[4] - b * xy[3]) / area; };
    const auto along = [&](double a, double b) { return (b * xy[0] - a * xy[1]) / area; };
    return choice.on_ground({xy[2], xy[5], height.offset},
                            {across(map[0], map[1]), along(map[0], map[1]), 0,  //
                             across(map[3], map[4]), along(map[3], map[4]), 0,  //
                             0, 0, map[8] / height.scale});
  };
}

// An attribute that is an axis of distances.
struct AttributeAxis {
  stream::Channel channel;
  std::size_t offset = 0;  // in a record
};

AttributeAxis axis_of(const std::string& name, const BuildRequest& request,
                      const stream::Schema& schema) {
  std::string known;
  for (std::size_t i = 0; i < schema.attributes.size(); ++i) {
    const stream::Channel& attribute = schema.attributes[i];
    if (stream::is_shape_column(attribute.name, request.entities)) continue;
    if (attribute.name == name) return {attribute, schema.attribute_offset(i)};
    known += (known.empty() ? "" : ", ") + attribute.name;
  }
  const bool points = request.entities == stream::Entities::points;
  throw stream::Error(input_name(request),
                      fmt::format("its {} have no {} \"{}\"", stream::name_of(request.entities),
                                  points ? "attribute" : "property", name))
      .remedy(known.empty() ? stream::message("they have none: leave out {channel}")
                            : stream::message("{channel} takes one of these: {}", known));
}

void set_channels(const BuildRequest& request, const stream::Schema& schema,
                  cluster::HierarchyOptions& options) {
  std::vector<AttributeAxis> axes;
  for (const auto& [name, weight] : request.channels) {
    axes.push_back(axis_of(name, request, schema));
    options.channels.weights.push_back(weight);
  }
  if (axes.empty()) return;
  options.channels.read = [axes, file = input_name(request)](std::span<const std::byte> record,
                                                             std::span<double> values) {
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const stream::Channel& channel = axes[i].channel;
      values[i] = stream::to_double(channel.type, record.data() + axes[i].offset) * channel.scale +
                  channel.offset;
      if (std::isfinite(values[i])) continue;
      throw stream::Error(file, fmt::format("\"{}\" of a point is not finite", channel.name))
          .remedy(stream::message("leave such points out with {where}, or the "
                                  "attribute out of {channel}"));
    }
  };
}

/// Fills `places` with the first and last of `vertices` and others at equal distances between them,
/// so that polylines with different numbers of vertices can be compared.
void spread_along(std::span<const stream::Point3> vertices, std::span<stream::Point3> places) {
  std::array<double, stream::kPolylineVertices> along{};
  const std::size_t last = vertices.size() - 1;
  for (std::size_t i = 0; i < last; ++i) {
    double squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = vertices[i + 1][axis] - vertices[i][axis];
      squares += step * step;
    }
    along[i + 1] = along[i] + std::sqrt(squares);
  }
  for (std::size_t k = 0, i = 0; k < places.size(); ++k) {
    const double at = along[last] * static_cast<double>(k) / static_cast<double>(places.size() - 1);
    while (i + 1 < last && along[i + 1] < at) ++i;
    const double length = along[i + 1] - along[i];
    const double part = length > 0 ? std::min(1.0, (at - along[i]) / length) : 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      places[k][axis] = (1 - part) * vertices[i][axis] + part * vertices[i + 1][axis];
    }
  }
  places.back() = vertices[last];
}

void set_corners(const BuildRequest& request, const stream::Schema& schema,
                 cluster::HierarchyOptions& options) {
  if (request.entities == stream::Entities::points) return;
  const std::string_view entities = stream::name_of(request.entities);
  if (request.metric.kind != MetricChoice::Kind::euclidean ||
      std::isfinite(request.outlier_price)) {
    throw UsageError(
        stream::message("{entities} {} are clustered by Euclidean distances: without {metric} and "
                        "{outlier_price}",
                        entities));
  }
  using cluster::FacilityStrategy;
  if (request.strategy != FacilityStrategy::automatic &&
      request.strategy != FacilityStrategy::full_scan &&
      request.strategy != FacilityStrategy::facilities) {
    throw UsageError(stream::message(
        "{entities} {} do not support the {} search: choose automatic, full scan or facilities",
        entities, cluster::name_of(request.strategy)));
  }
  const CornerReader read(schema, request.entities, input_name(request));
  options.corners.count = read.max_corners();
  options.corners.ordered = request.entities == stream::Entities::polylines;
  if (!options.corners.ordered) {
    options.corners.read = read;
    return;
  }
  options.corners.read = [read](std::span<const std::byte> record,
                                std::span<stream::Point3> corners) {
    std::array<stream::Point3, stream::kPolylineVertices> vertices{corners[0]};
    const std::size_t count = read(record, vertices);
    spread_along(std::span(vertices).first(count), corners);
  };
}

/// Returns whether no block needs a local search.
bool never_searches(const BuildRequest& request) {
  using Kind = MetricChoice::Kind;
  return request.strategy == cluster::FacilityStrategy::automatic && request.channels.empty() &&
         request.entities == stream::Entities::points &&
         (request.metric.kind == Kind::euclidean || request.metric.kind == Kind::elliptical);
}

}  // namespace

void check_clustering(const BuildRequest& request) {
  if (request.k > kMaxMedians) {
    throw UsageError(
        stream::message("{k} is at most {}, not {}", with_commas(kMaxMedians), request.k));
  }
  if (request.k > 0 && request.entities != stream::Entities::points) {
    throw UsageError(stream::message("{k} is for points: {entities} {} excludes it",
                                     stream::name_of(request.entities)));
  }
  if (request.k > 0 && std::isfinite(request.outlier_price)) {
    throw UsageError(stream::message("give either {k} or {outlier_price}"));
  }
  if (request.batch == 0 || request.search_threads == 0) {
    throw UsageError(stream::message("{batch} and {search_threads} are at least 1"));
  }
  if ((request.batch > 1 || request.search_threads > 1) && never_searches(request)) {
    throw UsageError(stream::message(
        "{batch} and {search_threads} are for local searches: choose one by {strategy}, or leave "
        "them out"));
  }
}

std::size_t block_points_for(const BuildRequest& request) {
  // With fewer points per median, the medians of a stream cost more: see the hierarchy's tests.
  constexpr std::size_t kPointsPerMedian = 100;
  return std::max(request.block_points, kPointsPerMedian * request.k);
}

void add_outlier_mark(const BuildRequest& request, std::vector<stream::Channel>& attributes) {
  if (std::isinf(request.outlier_price)) return;
  const auto same = [](const stream::Channel& channel) { return channel.name == kOutlierName; };
  if (std::any_of(attributes.begin(), attributes.end(), same)) {
    throw stream::Error(input_name(request),
                        stream::message("its points already have an attribute \"{}\", the name "
                                        "that {outlier_price} marks outliers with",
                                        kOutlierName))
        .remedy(stream::message("leave it out: {drop} {}", kOutlierName));
  }
  attributes.push_back({kOutlierName, stream::ScalarType::u8});
}

void append_zero_byte(std::span<const std::byte> records, std::size_t record_bytes,
                      std::size_t count, std::vector<std::byte>& result) {
  result.resize(count * (record_bytes + 1));
  for (std::size_t i = 0; i < count; ++i) {
    std::byte* to = result.data() + i * (record_bytes + 1);
    if (record_bytes > 0) std::memcpy(to, records.data() + i * record_bytes, record_bytes);
    to[record_bytes] = std::byte{0};
  }
}

cluster::HierarchyOptions clustering_of(const BuildRequest& request, const stream::Schema& schema,
                                        const Ground& ground) {
  cluster::HierarchyOptions options;
  options.block_size = request.block_points;
  options.medians = request.k;
  options.block.facility_cost = request.facility_cost;
  options.block.effort = request.effort;
  options.block.seed = request.seed;
  options.strategy = request.strategy;
  options.batch = request.batch;
  options.search_threads = request.search_threads;
  options.payload_size = schema.payload_size();
  options.ground = [&ground](const base::Box3& bounds) { return ground.map(bounds); };
  set_metric(request, schema, ground, options);
  set_channels(request, schema, options);
  set_corners(request, schema, options);
  options.outlier_price = request.outlier_price;
  options.mark_outlier = [](std::span<std::byte> record) { record.back() = std::byte{1}; };
  return options;
}

}  // namespace terrace::terrain
