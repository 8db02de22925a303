// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/merge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/hilbert.hpp>
#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "base/units.hpp"
#include "build/clustering.hpp"
#include "build/common_frame.hpp"
#include "build/store_extension.hpp"
#include "earth/ground.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/store_sink.hpp"

namespace terrace::terrain {
namespace {

using stream::StorePart;

/// Cells of a raster that are compared with those of another one at once.
constexpr std::uint64_t kWindowCells = std::uint64_t{1} << 22;

/// Returns the stores along a Hilbert curve through the centres of their bounds in the CRS, so that
/// blocks of their top levels are compact.
std::vector<stream::Store> in_order(std::vector<stream::Store> stores) {
  struct Entry {
    std::uint64_t key = 0;
    std::uint32_t checksum = 0;
    std::size_t number = 0;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<stream::Point3> centres;
  stream::Box3 around;
  for (const stream::Store& store : stores) {
    const stream::Box3 box = world_box(store.schema(), store.bounds());
    centres.push_back(
        {0.5 * box.min[0] + 0.5 * box.max[0], 0.5 * box.min[1] + 0.5 * box.max[1], 0});
    around.include(centres.back());
  }
  const double side = std::max(around.max[0] - around.min[0], around.max[1] - around.min[1]);
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < stores.size(); ++i) {
    std::array<std::uint32_t, 2> cell{};
    for (std::size_t axis = 0; axis < 2 && side > 0.0; ++axis) {
      cell[axis] = static_cast<std::uint32_t>((centres[i][axis] - around.min[axis]) / side *
                                              ((1u << 28) - 1));
    }
    entries.push_back({base::hilbert_index<28>(cell[0], cell[1]), stores[i].checksum(), i});
  }
  std::sort(entries.begin(), entries.end());
  std::vector<stream::Store> ordered;
  for (const Entry& entry : entries) ordered.push_back(stores[entry.number]);
  return ordered;
}

/// Throws: stream::Error if both rasters have a value for a cell.
void check_cells_apart(const StorePart& a, const StorePart& b) {
  stream::Box3 common = a.store.bounds();
  stream::Box3 of_b = b.store.bounds();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto by_a = static_cast<double>(a.shift[axis]), by_b = static_cast<double>(b.shift[axis]);
    common.min[axis] = std::max(common.min[axis] + by_a, of_b.min[axis] + by_b);
    common.max[axis] = std::min(common.max[axis] + by_a, of_b.max[axis] + by_b);
    if (common.min[axis] > common.max[axis]) return;
  }
  stream::StoreQuery query_a(a.store), query_b(b.store);
  const double columns = common.max[0] - common.min[0] + 1;
  const double rows_at_once =
      std::max(1.0, std::floor(static_cast<double>(kWindowCells) / columns));
  std::vector<bool> taken;
  for (double row = common.min[1]; row <= common.max[1]; row += rows_at_once) {
    const double end = std::min(common.max[1], row + rows_at_once - 1);
    const auto found = [&](stream::StoreQuery& query, const StorePart& part) {
      stream::Box3 box = part.store.bounds();
      const stream::Point3 by{static_cast<double>(part.shift[0]),
                              static_cast<double>(part.shift[1]), 0};
      box.min[0] = common.min[0] - by[0];
      box.max[0] = common.max[0] - by[0];
      box.min[1] = row - by[1];
      box.max[1] = end - by[1];
      std::vector<stream::FoundPoint> points = query.in_box(box);
      for (stream::FoundPoint& point : points) {
        for (std::size_t axis = 0; axis < 2; ++axis) point.position[axis] += by[axis];
      }
      return points;
    };
    const auto cell_of = [&](const stream::FoundPoint& point) {
      return static_cast<std::size_t>((point.position[1] - row) * columns + point.position[0] -
                                      common.min[0]);
    };
    taken.assign(static_cast<std::size_t>((end - row + 1) * columns), false);
    for (const stream::FoundPoint& point : found(query_a, a)) taken[cell_of(point)] = true;
    for (const stream::FoundPoint& point : found(query_b, b)) {
      if (!taken[cell_of(point)]) continue;
      const stream::Point3 place =
          world_point(b.store.schema(), {point.position[0] - static_cast<double>(b.shift[0]),
                                         point.position[1] - static_cast<double>(b.shift[1]), 0});
      throw misfit(a.store.path().string(), b.store.path().string(),
                   fmt::format("both have a value for the cell at {}, {}", plain_number(place[0]),
                               plain_number(place[1])))
          .remedy(stream::message("build one of them without these cells ({region}), or build the "
                                  "sources together, where the first file decides"));
    }
  }
}

/// Joins stores that fit together.
class Merge {
 public:
  Merge(const MergeRequest& request, const Context& context) : context_(context) {
    std::vector<stream::Store> stores;
    for (const std::filesystem::path& path : request.stores) {
      stores.push_back(stream::Store::open(path).with_stop(context.stop));
      if (stores.back().points() == 0) {
        throw stream::Error(path.string(), "has no points").remedy("leave it out");
      }
    }
    stores = in_order(std::move(stores));
    for (std::size_t i = 0; i + 1 < stores.size(); ++i) {
      for (std::size_t j = i + 1; j < stores.size(); ++j) {
        if (stores[i].checksum() != stores[j].checksum()) continue;
        throw stream::Error(stores[j].path().string(),
                            fmt::format("is the same store as {}", stores[i].path().string()))
            .remedy("give it once");
      }
    }
    std::vector<FramedPoints> framed;
    for (const stream::Store& store : stores) framed.push_back(framed_points(store));
    CommonFrame frame = common_frame(framed);
    schema_ = std::move(frame.schema);
    for (std::size_t i = 0; i < stores.size(); ++i) {
      parts_.push_back({stores[i], frame.shifts[i]});
    }
    if (schema_.grid) {
      for (std::size_t i = 0; i < parts_.size(); ++i) {
        for (std::size_t j = i + 1; j < parts_.size(); ++j) check_cells_apart(parts_[i], parts_[j]);
      }
    }
  }

  MergeOutcome run(const MergeRequest& request);

 private:
  const Context& context_;
  std::vector<StorePart> parts_;
  stream::StoreSchema schema_;
};

MergeOutcome Merge::run(const MergeRequest& request) {
  MergeOutcome outcome;
  BuildRequest clustering = recorded_request(schema_, parts_.front().store.path().string());
  const Ground ground(schema_, clustering.z_weight);
  stream::StoreWriter writer(request.store, schema_, parts_, request.replace, context_.threads);
  StoreSink sink(writer, /*publish=*/true, context_.stop);
  cluster::HierarchyOptions options = clustering_of(clustering, schema_, ground);
  options.threads = context_.threads;
  options.stop = context_.stop;
  unsigned highest = 0;
  for (const StorePart& part : parts_) highest = std::max(highest, part.store.top());
  for (unsigned l = 0; l < highest; ++l) {
    options.existing_clusters.push_back(writer.clusters(l));
    outcome.clusters += writer.clusters(l);
  }
  cluster::HierarchyBuilder builder(options, sink);
  std::vector<std::uint64_t> offsets(highest, 0);
  for (const StorePart& part : parts_) {
    push_root(part, offsets, builder);
    for (unsigned l = 0; l < part.store.top(); ++l) {
      offsets[l] += part.store.levels()[l].clusters;
    }
  }
  builder.finish();
  for (const StorePart& part : parts_) {
    if (!part.store.surface()) continue;
    context_.say(stream::message("the surface of {} is left out", part.store.path().string()));
  }
  const stream::Store merged = stream::Store::open(request.store);
  outcome.points = merged.points();
  outcome.top = merged.top();
  outcome.store_bytes = sink.store_bytes();
  for (const stream::LevelInfo& level : merged.levels()) {
    outcome.segments += level.segments;
    outcome.new_clusters += level.clusters;
  }
  outcome.new_clusters -= outcome.clusters;
  return outcome;
}

}  // namespace

MergeOutcome merge_stores(const MergeRequest& request, const Context& context) {
  if (request.stores.size() < 2) {
    throw UsageError("a merge joins two or more stores");
  }
  return Merge(request, context).run(request);
}

}  // namespace terrace::terrain
