// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/engine.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "ground.hpp"

namespace terrace::cluster {
namespace {

constexpr unsigned kMaxThreads = 1024;

void check_corners(const HierarchyOptions& options) {
  const PayloadCorners& corners = options.corners;
  if (corners.count == 1) return;
  if (corners.count == 0 || (corners.count > 3 && !corners.ordered)) {
    throw std::invalid_argument("entities of " + std::to_string(corners.count) +
                                " corners: there must be at least 1, and at most 3 unless they "
                                "are ordered");
  }
  if (!corners.read) throw std::invalid_argument("corners have no function that reads them");
  if (!std::holds_alternative<Euclidean>(options.metric) || options.metric_of ||
      std::isfinite(options.outlier_price)) {
    throw std::invalid_argument(
        "entities of several corners are clustered by Euclidean distances, without outliers");
  }
}

void check_medians(const HierarchyOptions& options) {
  if (options.medians == 0) return;
  if (options.medians >= options.block_size) {
    throw std::invalid_argument("medians is " + std::to_string(options.medians) +
                                ": it must be below block_size, " +
                                std::to_string(options.block_size));
  }
  if (options.corners.count > 1 || std::isfinite(options.outlier_price)) {
    throw std::invalid_argument("medians are those of points, without outliers");
  }
}

HierarchyOptions checked(HierarchyOptions options) {
  if (options.block_size < 2 || options.block_size >= (std::size_t{1} << 24)) {
    throw std::invalid_argument("block_size is " + std::to_string(options.block_size) +
                                "; it must be at least 2 and below 2^24");
  }
  if (!(options.block.facility_cost > 0.0) || !std::isfinite(options.block.facility_cost)) {
    throw std::invalid_argument("facility_cost must be positive and finite");
  }
  check(options.metric);
  for (std::size_t c = 0; c < options.channels.weights.size(); ++c) {
    const double weight = options.channels.weights[c];
    if (weight >= 0.0 && std::isfinite(weight)) continue;
    throw std::invalid_argument("the weight of channel " + std::to_string(c) + " is " +
                                std::to_string(weight) + ": it must be finite and not negative");
  }
  if (!options.channels.weights.empty() && !options.channels.read) {
    throw std::invalid_argument("channels have weights but no function that reads them");
  }
  if (!(options.outlier_price > 0.0)) {
    throw std::invalid_argument("outlier_price must be positive");
  }
  if (std::isfinite(options.outlier_price) && !options.mark_outlier) {
    throw std::invalid_argument(
        "outlier_price is set, but there is no function that marks outliers");
  }
  check_corners(options);
  check_medians(options);
  options.threads = std::clamp(options.threads, 1u, kMaxThreads);
  return options;
}

}  // namespace

HierarchyEngine::HierarchyEngine(HierarchyOptions options, HierarchySink& sink,
                                 const std::function<ClusterFunction()>& make_cluster)
    : options_(checked(std::move(options))),
      sink_(sink),
      base_(level_at(0)),
      pipeline_(options_.threads,
                {[this](HierarchyBlock& block, unsigned thread) { process(block, thread); },
                 [this](HierarchyBlock& block) { commit(block); }, options_.on_failure}) {
  // No thread uses the processors before the first block is submitted.
  processors_.reserve(options_.threads);
  for (unsigned i = 0; i < options_.threads; ++i) {
    processors_.emplace_back(options_, make_cluster());
  }
}

void HierarchyEngine::check_open() {
  if (ended_) throw std::logic_error("the hierarchy has ended or failed; it accepts no points");
}

void HierarchyEngine::push(std::span<const Point3> positions, std::span<const std::byte> payload) {
  check_open();
  if (payload.size() != positions.size() * options_.payload_size) {
    throw std::invalid_argument("the payload has " + std::to_string(payload.size()) + " bytes; " +
                                std::to_string(positions.size()) + " points with " +
                                std::to_string(options_.payload_size) + " bytes each need " +
                                std::to_string(positions.size() * options_.payload_size));
  }
  if (const std::size_t bad = first_not_finite(positions); bad < positions.size()) {
    throw std::invalid_argument("point " + std::to_string(bad) +
                                " of the batch has a coordinate that is not finite");
  }
  const std::size_t open_points = base_.open ? base_.open->size() : 0;
  const bool fits_a_block = positions.size() <= options_.block_size;
  ended_ = true;  // in case anything below throws
  if (positions.empty()) pipeline_.wait_for_room();
  if (fits_a_block && open_points + positions.size() > options_.block_size) submit(base_);
  while (!positions.empty()) {
    if (base_.open && base_.open->size() == options_.block_size) submit(base_);
    const std::size_t room = options_.block_size - (base_.open ? base_.open->size() : 0);
    const std::size_t count = std::min(room, positions.size());
    append(positions.first(count), payload.first(count * options_.payload_size));
    positions = positions.subspan(count);
    payload = payload.subspan(count * options_.payload_size);
    pipeline_.wait_for_room();
  }
  ended_ = false;
}

void HierarchyEngine::append(std::span<const Point3> positions,
                             std::span<const std::byte> payload) {
  if (!base_.open) base_.open = pipeline_.take(0);
  HierarchyBlock& block = *base_.open;
  block.positions.insert(block.positions.end(), positions.begin(), positions.end());
  block.payload.insert(block.payload.end(), payload.begin(), payload.end());
  base_.points += positions.size();
}

/// Returns a level; adds it and those below if necessary.
auto HierarchyEngine::level_at(unsigned number) -> Level& {
  const std::vector<std::uint64_t>& existing = options_.existing_clusters;
  while (levels_.size() <= number) {
    const std::size_t added = levels_.size();
    Level& level = levels_.emplace_back();
    level.level = static_cast<unsigned>(added);
    if (added < existing.size()) level.clusters = existing[added];
  }
  return levels_[number];
}

void HierarchyEngine::push_heads(const ClusterHeads& heads) {
  check_open();
  const std::size_t count = heads.positions.size();
  if (heads.payload.size() != count * options_.payload_size ||
      heads.children.size() != count * heads.level || heads.summaries.size() != count) {
    throw std::invalid_argument("the payload, children and summaries are not those of " +
                                std::to_string(count) + " points");
  }
  if (heads.level == 0) throw std::invalid_argument("points of level 0 head no clusters");
  if (const std::size_t bad = first_not_finite(heads.positions); bad < count) {
    throw std::invalid_argument("point " + std::to_string(bad) +
                                " of the batch has a coordinate that is not finite");
  }
  ended_ = true;             // in case anything below throws
  pipeline_.wait_for_all();  // upper levels belong to the committing thread
  lowest_top_ = std::max(lowest_top_, heads.level);
  Level& level = level_at(heads.level);
  for (std::size_t i = 0; i < count; ++i) {
    if (level.open && level.open->size() == options_.block_size) submit(level);
    if (!level.open) level.open = pipeline_.take(heads.level);
    level.open->append_head(heads, i, options_.payload_size);
    ++level.points;
  }
  pipeline_.wait_for_all();
  ended_ = false;
}

void HierarchyEngine::submit(Level& level) {
  level.open->number = level.blocks++;
  pipeline_.submit(std::move(level.open));
}

void HierarchyEngine::process(HierarchyBlock& block, unsigned thread) {
  processors_[thread].process(block);
  block.prepared = sink_.prepare(block.finished());
}

void HierarchyEngine::commit(HierarchyBlock& block) {
  sink_.commit(block.level, std::move(block.prepared));
  Level& upper = level_at(block.level + 1);
  outliers_ += block.outliers;
  Level& level = levels_[block.level];
  for (std::size_t c = 0; c < block.summaries.size(); ++c) {
    if (upper.open && upper.open->size() == options_.block_size) submit(upper);
    if (!upper.open) upper.open = pipeline_.take(upper.level);
    upper.open->append_representative(block, c, level.clusters++, options_.payload_size);
    ++upper.points;
  }
}

HierarchyResult HierarchyEngine::finish() {
  check_open();
  ended_ = true;
  // A level that has submitted a block also has an open one. wait_for_all() completes the level
  // above, which exists by then.
  unsigned top = 0;
  for (; levels_[top].blocks > 0 || top < lowest_top_; ++top) {
    if (levels_[top].open) submit(levels_[top]);
    pipeline_.wait_for_all();
  }
  pipeline_.wait_for_all();
  if (options_.medians > 0 && levels_[top].points > options_.medians) {
    levels_[top].open->medians = options_.medians;
    submit(levels_[top++]);
    pipeline_.wait_for_all();
  }
  deliver_root(levels_[top]);

  HierarchyResult result;
  result.outliers = outliers_;
  result.points = base_.points;
  result.top = top;
  for (const Level& level : levels_) {
    result.level_points.push_back(level.points);
    result.level_clusters.push_back(level.clusters);
  }
  return result;
}

void HierarchyEngine::deliver_root(Level& level) {
  if (!level.open) level.open = pipeline_.take(level.level);  // there were no points
  HierarchyBlock& block = *level.open;
  if (block.level == 0 && block.size() > 0 && std::isfinite(options_.outlier_price)) {
    processors_.front().process(block);  // only to mark outliers; other results are discarded
    outliers_ += block.outliers;
  }
  block.clustering.facilities.assign(1, kNoRepresentative);
  block.first = {0, static_cast<std::uint32_t>(block.size())};
  block.order.resize(block.size());
  std::iota(block.order.begin(), block.order.end(), 0u);
  ClusterSummary summary{base::box_of(block.positions), 0.0, block.size()};
  if (block.level > 0) {
    summary.descendants = 0;
    for (const ClusterSummary& head : block.heads) {
      summary.box.include(head.box);
      summary.descendants += head.descendants;
    }
  }
  block.summaries.assign(1, summary);
  ++level.clusters;
  sink_.root(block.finished());
}

}  // namespace terrace::cluster
