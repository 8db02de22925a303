// SPDX-License-Identifier: Apache-2.0
#include "window_demand.hpp"

#include <algorithm>

namespace terrace::tri {
namespace {

/// Shares of the tolerance, see below.
constexpr double kSoon = 0.95, kAhead = 0.8;
/// The step from which windows become coarser for lack of room: 2^-10 of the unit of heights.
constexpr ThinnedDelaunay2::Step kFinest = -10 * ThinnedDelaunay2::kStepsPerDoubling;

}  // namespace

std::span<const WindowDemand::Change> WindowDemand::changes(const ThinnedDelaunay2& raster,
                                                            const ViewWindows& windows,
                                                            const View& view,
                                                            const ViewOptions& options,
                                                            int coarser) {
  using Step = ThinnedDelaunay2::Step;
  changes_.clear();
  numbers_.clear();
  for (std::uint32_t i = 0; i < raster.window_slots(); ++i) {
    const ThinnedDelaunay2::Window* const window = raster.window(i);
    if (window != nullptr && window->complete) numbers_.push_back(i);
  }
  if (numbers_.empty()) return changes_;
  columns_.resize(numbers_.size());
  demand_.resize(numbers_.size());
  for (std::size_t i = 0; i < numbers_.size(); ++i)
    columns_.set(i, {windows.box_of(*raster.window(numbers_[i])), 1.0, 0}, 0);
  // For an error of one ground unit, demands are reciprocals of tolerances.
  measure(view, options, columns_, 0, numbers_.size(), demand_);
  const double scale = options.raster.height_scale();
  const auto step_of = [&](double demand) {
    const Step step = demand > 0.0 ? ThinnedDelaunay2::step_of(1.0 / (demand * scale))
                                   : ThinnedDelaunay2::kFewest;
    if (coarser == 0) return step;
    return static_cast<Step>(
        std::min<int>(std::max(step, kFinest) + coarser, ThinnedDelaunay2::kFewest));
  };
  // An error in pixels changes all the time. So windows become finer a little before they must and
  // by more than they must, and become coarser by less than they might.
  const double soon = view.camera ? kSoon : 1.0, ahead = view.camera ? kAhead : 1.0;
  for (std::size_t i = 0; i < numbers_.size(); ++i) {
    const ThinnedDelaunay2::Window& window = *raster.window(numbers_[i]);
    const double want = demand_.want[i];
    const double error = window.thinned ? ThinnedDelaunay2::tolerance_of(window.step)
                                        : window.highest - window.lowest;
    Change change{want * scale * error, {numbers_[i], step_of(want / ahead)}, false};
    if (window.thinned && window.step <= step_of(want / soon)) {
      if (window.step >= step_of(demand_.keep[i] / options.collapse_below)) continue;
      change = {0.0, {numbers_[i], step_of(want / soon)}, true};
      if (change.target.step <= window.step) continue;
    }
    changes_.push_back(change);
  }
  std::sort(changes_.begin(), changes_.end(), [&](const Change& a, const Change& b) {
    if (a.urgency != b.urgency) return a.urgency > b.urgency;
    const auto &p = raster.window(a.target.window)->low, &q = raster.window(b.target.window)->low;
    return p[1] != q[1] ? p[1] < q[1] : p[0] < q[0];
  });
  return changes_;
}

}  // namespace terrace::tri
