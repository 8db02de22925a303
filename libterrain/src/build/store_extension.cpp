// SPDX-License-Identifier: Apache-2.0
#include "build/store_extension.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/overlay.hpp>

#include "base/units.hpp"
#include "build/clustering.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

void move(stream::Point3& p, const std::array<std::int64_t, 3>& shift) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // A sum would lose the sign of zero.
    if (shift[axis] != 0) p[axis] += static_cast<double>(shift[axis]);
  }
}

stream::Store open_without_overlays(const BuildRequest& request) {
  stream::Store store = stream::Store::open(request.store);
  if (store.points() == 0) {
    throw stream::Error(request.store.string(), "the store has no points")
        .remedy(stream::message("build it again, without {append}"));
  }
  const std::vector<std::string> overlays = stream::overlays_in(request.store);
  if (overlays.empty()) return store;
  throw stream::Error(request.store.string(),
                      fmt::format("it contains {}, an overlay of its present points", overlays[0]))
      .remedy("move it away: it does not apply to a store with more points");
}

}  // namespace

void push_root(const stream::StorePart& part, std::span<const std::uint64_t> offsets,
               cluster::HierarchyBuilder& builder) {
  const unsigned top = part.store.top();
  stream::ClusterPoints root;
  part.store.read(part.store.root(), root);
  for (stream::Point3& p : root.positions) move(p, part.shift);
  if (top == 0) {
    builder.push(root.positions, root.payload);
    return;
  }
  std::vector<cluster::ClusterSummary> summaries;
  for (std::size_t i = 0; i < root.size(); ++i) {
    const std::uint64_t below = root.children[i * top + top - 1];
    summaries.push_back(part.store.record(stream::cluster_id(top - 1, below)).summary);
    move(summaries.back().box.min, part.shift);
    move(summaries.back().box.max, part.shift);
    for (unsigned l = 0; l < top; ++l) root.children[i * top + l] += offsets[l];
  }
  builder.push_heads({.level = top,
                      .positions = root.positions,
                      .payload = root.payload,
                      .children = root.children,
                      .summaries = summaries});
}

StoreExtension::StoreExtension(const BuildRequest& request)
    : part_{open_without_overlays(request), {}}, query_(part_.store) {}

BuildRequest StoreExtension::clustering_as_before(const BuildRequest& request) const {
  const BuildRequest recorded = recorded_request(part_.store.schema(), part_.store.path().string());
  const auto of_store = recorded_parameters(recorded), standard = recorded_parameters({});
  for (const auto& parameter : recorded_parameters(request)) {
    const auto has = [&parameter](const auto& all) {
      return std::find(all.begin(), all.end(), parameter) != all.end();
    };
    // Defaults do not matter, nor does the seed.
    if (has(standard) || has(of_store) || parameter.first == "seed") continue;
    const auto found = std::find_if(of_store.begin(), of_store.end(), [&](const auto& other) {
      return other.first == parameter.first;
    });
    throw UsageError(stream::message(
        "{append} clusters as the store: {} is {}, not {}", parameter.first,
        found == of_store.end() ? std::string("not set") : found->second, parameter.second));
  }
  BuildRequest result =
      recorded_request(part_.store.schema(), part_.store.path().string(), request);
  result.seed = request.seed;
  return result;
}

void StoreExtension::set_source(const stream::SourceInfo& info, const stream::StoreSchema& schema) {
  name_ = info.files.empty() ? std::string("the source") : info.files.front();
  FramedPoints added{schema, {}, name_};
  added.schema.nodata = 0;  // known at the end of the source
  if (schema.grid) {
    added.bounds = {
        {0, 0, 0},
        {static_cast<double>(schema.columns - 1), static_cast<double>(schema.rows - 1), 0}};
  }
  const FramedPoints all[] = {framed_points(part_.store), added};
  frame_ = common_frame(all);
  part_.shift = frame_.shifts[0];
}

void StoreExtension::place(stream::PointBlock& block) {
  const std::array<std::int64_t, 3>& shift = frame_.shifts[1];
  if (shift != std::array<std::int64_t, 3>{}) {
    constexpr double kMost = std::numeric_limits<std::int32_t>::max();
    for (stream::Point3& p : block.positions) {
      move(p, shift);
      for (std::size_t axis = frame_.schema.grid ? 2 : 0; axis < 3; ++axis) {
        if (frame_.schema.coordinates[axis].type != stream::ScalarType::i32 ||
            std::abs(p[axis]) <= kMost) {
          continue;
        }
        throw misfit(part_.store.path().string(), name_,
                     "a point is too far away for the 32 bits of its coordinates")
            .remedy("build a separate store");
      }
    }
  }
  if (frame_.schema.grid && !block.empty()) leave_out_known(block);
}

void StoreExtension::leave_out_known(stream::PointBlock& block) {
  stream::Box3 box = base::box_of(block.positions);
  const stream::Box3 stored = part_.store.bounds();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    box.min[axis] -= static_cast<double>(part_.shift[axis]);
    box.max[axis] -= static_cast<double>(part_.shift[axis]);
    if (box.min[axis] > stored.max[axis] || box.max[axis] < stored.min[axis]) return;
  }
  box.min[2] = stored.min[2];
  box.max[2] = stored.max[2];
  const std::vector<stream::FoundPoint> found = query_.in_box(box);
  if (found.empty()) return;
  const std::size_t bytes = frame_.schema.payload_size();
  const std::vector<std::byte> values = query_.attributes(found);
  const double columns = box.max[0] - box.min[0] + 1;
  const auto cell_of = [&](const stream::Point3& p) {
    return static_cast<std::uint64_t>((p[1] - box.min[1]) * columns + p[0] - box.min[0]);
  };
  std::unordered_map<std::uint64_t, std::size_t> known;  // the index in `found`, by cell
  for (std::size_t i = 0; i < found.size(); ++i) known.emplace(cell_of(found[i].position), i);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < block.size(); ++i) {
    stream::Point3 p = block.positions[i];
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] -= static_cast<double>(part_.shift[axis]);
    const auto record = block.payload.begin() + static_cast<std::ptrdiff_t>(i * bytes);
    const auto at = known.find(cell_of(p));
    if (at != known.end()) {
      const stream::Point3& old = found[at->second].position;
      if (old[2] != p[2] ||
          !std::equal(record, record + static_cast<std::ptrdiff_t>(bytes),
                      values.begin() + static_cast<std::ptrdiff_t>(at->second * bytes))) {
        const stream::Point3 place = world_point(part_.store.schema(), old);
        throw misfit(
            part_.store.path().string(), name_,
            fmt::format("both have a value for the cell at {}, {}, and they differ: {} "
                        "and {}",
                        plain_number(place[0]), plain_number(place[1]), plain_number(place[2]),
                        plain_number(world_point(part_.store.schema(), p)[2])))
            .remedy(stream::message("append it without these cells ({region})"));
      }
      ++known_cells_;
      continue;
    }
    block.positions[kept] = block.positions[i];
    std::copy(record, record + static_cast<std::ptrdiff_t>(bytes),
              block.payload.begin() + static_cast<std::ptrdiff_t>(kept * bytes));
    ++kept;
  }
  block.positions.resize(kept);
  block.payload.resize(kept * bytes);
}

std::vector<std::uint64_t> StoreExtension::clusters() const {
  std::vector<std::uint64_t> clusters;
  for (unsigned l = 0; l < part_.store.top(); ++l) {
    clusters.push_back(part_.store.levels()[l].clusters);
  }
  return clusters;
}

void StoreExtension::push_root(cluster::HierarchyBuilder& builder) const {
  const std::vector<std::uint64_t> offsets(part_.store.top(), 0);
  terrain::push_root(part_, offsets, builder);
}

}  // namespace terrace::terrain
