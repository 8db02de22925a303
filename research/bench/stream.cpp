// SPDX-License-Identifier: GPL-3.0-or-later
#include "stream.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

namespace terrace::research {

using namespace cluster;

namespace {

class Timed {
 public:
  explicit Timed(double& seconds) : seconds_(seconds) {}
  ~Timed() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

/// Adds up the costs of the blocks of level 0, and discards the blocks.
class StreamClustering::Weighing final : public HierarchySink {
 public:
  Weighing(double facility_cost, OnBlock on_block)
      : facility_cost_(facility_cost), on_block_(std::move(on_block)) {}

  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    if (block.level > 0) return nullptr;
    StreamBlock weighed{.block = block};
    weighed.facility_cost = facility_cost_ * diagonal(Euclidean{}, base::box_of(block.positions));
    for (std::size_t c = 0; c < block.representatives.size(); ++c) {
      const Point3& facility = block.positions[block.representatives[c]];
      for (std::uint32_t k = block.first[c]; k < block.first[c + 1]; ++k) {
        weighed.cost += distance(Euclidean{}, facility, block.positions[block.order[k]]);
      }
    }
    weighed.cost += weighed.facility_cost * static_cast<double>(block.representatives.size());
    cost += weighed.cost;
    if (on_block_) on_block_(weighed);
    return nullptr;
  }
  void commit(unsigned /*level*/, std::unique_ptr<Prepared> /*prepared*/) override {}
  void root(const ClusteredBlock& /*block*/) override {}

  double cost = 0.0;

 private:
  double facility_cost_;
  OnBlock on_block_;
};

StreamClustering::StreamClustering(const StreamOptions& options, OnBlock on_block)
    : block_(options.block),
      sink_(std::make_unique<Weighing>(options.facility_cost, std::move(on_block))) {
  HierarchyOptions hierarchy;
  hierarchy.block_size = options.block;
  hierarchy.block.facility_cost = options.facility_cost;
  hierarchy.block.effort = options.effort;
  hierarchy.strategy =
      options.strategy == FacilityStrategy::fast ? FacilityStrategy::automatic : options.strategy;
  hierarchy.search_threads = options.threads;
  hierarchy.batch = options.batch;
  builder_ = std::make_unique<HierarchyBuilder>(std::move(hierarchy), *sink_);
}

StreamClustering::~StreamClustering() = default;
StreamClustering::StreamClustering(StreamClustering&&) noexcept = default;

void StreamClustering::push(std::span<const Point3> points) {
  const Timed timed(seconds_);
  // Fills blocks, as in the thesis. A batch that does not fit into the current block would begin
  // another one.
  while (!points.empty()) {
    const std::size_t count = std::min(points.size(), block_ - pending_);
    builder_->push(points.first(count));
    points = points.subspan(count);
    pending_ = (pending_ + count) % block_;
  }
}

void StreamClustering::finish() {
  const Timed timed(seconds_);
  result_ = builder_->finish();
}

double StreamClustering::cost() const { return sink_->cost; }

void run(PointSet& set, std::span<StreamClustering> streams) {
  std::array<Point3, 500> buffer;  // not on the heap, so that it is not counted as memory
  for (std::uint64_t first = 0; first < set.size(); first += buffer.size()) {
    const std::span points(
        buffer.data(), static_cast<std::size_t>(std::min<std::uint64_t>(500, set.size() - first)));
    set.read(first, points);
    for (StreamClustering& stream : streams) stream.push(points);
  }
  for (StreamClustering& stream : streams) stream.finish();
}

}  // namespace terrace::research
