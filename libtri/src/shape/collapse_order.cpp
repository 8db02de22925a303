// SPDX-License-Identifier: Apache-2.0
#include "collapse_order.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrace::tri::shape {
namespace {

/// A measured error that exceeds the estimate by less than this factor does not change the order.
constexpr double kSameError = 1.05;
constexpr std::size_t kStopInterval = 1024;

}  // namespace

CollapseOrder::CollapseOrder(const Surface& surface, double max_error, CollapseRule& rule,
                             base::StopCheck check_stop)
    : rule_(rule),
      check_stop_(std::move(check_stop)),
      frame_(surface.points),
      limit_(frame_.to_local(max_error)),
      shrinking_(surface, frame_),
      waits_(surface.points.size()) {
  for (std::uint32_t v = 0; v < waits_.size(); ++v) wait(v);
}

std::optional<CollapseOrder::Step> CollapseOrder::next() {
  while (!queue_.empty()) {
    if (check_stop_ && ++turns_ % kStopInterval == 0) check_stop_();
    const auto [expected_error, vertex, number] = queue_.top();
    queue_.pop();
    if (number != waits_[vertex].turn) continue;
    set_wait(vertex, Wait::nothing);
    const auto [target, cost] = cheapest(vertex);
    if (target == kNone) continue;
    const double error = shrinking_.error_after(vertex, target, limit_, largest_);
    if (!std::isfinite(error)) continue;
    // An error that is not the largest so far costs nothing.
    if (error > std::max(kSameError * expected_error, largest_) && !queue_.empty() &&
        error > queue_.top().error) {
      wait_with(vertex, error, Wait::measured);
      continue;
    }
    largest_ = std::max(largest_, error);
    shrinking_.collapse(vertex, target, around_);
    for (const std::uint32_t v : around_) wait(v);
    return Step{vertex, target, frame_.from_local(largest_)};
  }
  return std::nullopt;
}

void CollapseOrder::reconsider(std::uint32_t vertex) {
  shrinking_.with_neighbours(vertex, around_);
  for (const std::uint32_t v : around_) wait(v);
}

ShrinkingSurface::Collapse CollapseOrder::cheapest(std::uint32_t vertex) {
  return shrinking_.cheapest(
      vertex, [this, vertex](std::uint32_t target) { return rule_.allows(vertex, target); });
}

void CollapseOrder::set_wait(std::uint32_t vertex, Wait with) {
  const bool before = waits_[vertex].with != Wait::nothing, after = with != Wait::nothing;
  waits_[vertex].with = with;
  if (before != after) rule_.waits(vertex, after);
}

void CollapseOrder::wait_with(std::uint32_t vertex, double error, Wait with) {
  set_wait(vertex, with);
  queue_.push({error, vertex, ++waits_[vertex].turn});
}

void CollapseOrder::wait(std::uint32_t vertex) {
  if (waits_[vertex].with == Wait::estimate || !shrinking_.on_surface(vertex)) return;
  const auto [target, cost] = cheapest(vertex);
  if (target != kNone) wait_with(vertex, cost, Wait::estimate);
}

}  // namespace terrace::tri::shape
