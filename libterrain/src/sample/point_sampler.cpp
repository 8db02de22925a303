// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/available_memory.hpp"
#include "base/parallel.hpp"
#include "base/units.hpp"
#include "sample/samplers.hpp"
#include "surface/ground_slope.hpp"
#include "surface/point_surface.hpp"

namespace terrace::terrain {
namespace {

/// With more points, threads would wait for the last one.
constexpr double kMaxPointsAtOnce = 1U << 21;
constexpr double kPartsPerThread = 4;
/// A single place costs as much as loading this many points. In addition it reads all clusters
/// whose boxes contain it, which costs half as much per point.
constexpr double kPointsPerPlace = 4000;
constexpr double kReadShare = 0.5;
/// If places are sparse, they are grouped in boxes this many times smaller than a window along each
/// axis, and the surroundings of each group are loaded.
constexpr double kParts = 8;
/// Margin to load around a box, in mean distances of points; hardly any circle extends beyond it.
constexpr double kSampleMargin = 8;
/// Limit of the margin as a share of the longer side; otherwise a window in a void would load the
/// points of many windows around it.
constexpr double kMaxSampleMargin = 0.125;
/// Memory that a thread may need: a window of usual size where points are crowded.
constexpr std::uint64_t kThreadBytes = std::uint64_t{32} << 20;
/// Memory for reading, in addition to the points.
constexpr std::uint64_t kReadBytes = std::uint64_t{12} << 20;
/// Allows for half as many points again as expected, and for the points loaded around them.
constexpr double kBytesPerExpected = 2.0 * PointCells::kBytesPerPoint;

/// Returns the position along a curve through the box, so that the next place is usually near.
std::uint64_t place_on_curve(const StoredBox& box, const Point2& place) {
  std::uint64_t at = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double size = box.max[k] - box.min[k];
    const double share = (place[k] - box.min[k]) / size;
    // `share > 0` also excludes NaN, which occurs for boxes without a size or too large for a
    // double.
    auto bits = static_cast<std::uint64_t>(share > 0 ? std::min(share, 1.0) * 65535 : 0.0);
    bits = (bits | bits << 8) & 0x00FF00FFU;
    bits = (bits | bits << 4) & 0x0F0F0F0FU;
    bits = (bits | bits << 2) & 0x33333333U;
    bits = (bits | bits << 1) & 0x55555555U;
    at |= bits << k;
  }
  return at;
}

/// Returns how many points the clusters have whose boxes contain a place: few if points arrived in
/// order.
double points_met_by_a_place(const stream::Store& store, unsigned level) {
  const auto area = [](const stream::Box3& box) {
    return (box.max[0] - box.min[0]) * (box.max[1] - box.min[1]);
  };
  const double total_area = area(store.whole().bounds());
  const stream::LevelInfo& info = store.levels()[level];
  if (level == store.top() || !(total_area > 0)) return 0;
  constexpr std::uint64_t kLookedAt = 500;
  const std::uint64_t count = std::min(info.clusters, kLookedAt);
  double sum = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t ordinal = i * info.clusters / count;
    sum += area(store.record(stream::cluster_id(level, ordinal)).summary.box);
  }
  return static_cast<double>(info.points) * sum / static_cast<double>(count) / total_area;
}

/// The working data of one thread.
struct CloudWorker {
  PointSurface surface;
  std::vector<std::uint64_t> along{};  ///< positions on a curve, with numbers of places
  std::optional<StoredBox> loaded{};

  CloudWorker(PointCloud& cloud, const TooLong& too_long, std::uint64_t memory_bytes)
      : surface(cloud, too_long, memory_bytes) {}

  /// Loads the points in a box and `margin` around it, unless they are loaded. Returns false if
  /// they do not fit.
  bool load(const StoredBox& inner, double margin, std::size_t max_points, bool allow_crowding) {
    const StoredBox box = inner.widened(margin);
    if (loaded && loaded->min == box.min && loaded->max == box.max) return true;
    loaded.reset();
    if (!surface.load(box, max_points, allow_crowding)) return false;
    loaded = box;
    return true;
  }
};

class PointSampler final : public HeightSampler {
 public:
  PointSampler(std::shared_ptr<SampledCloud> sampled, const SamplerOptions& options,
               const Context& context)
      : sampled_(std::move(sampled)),
        cloud_(sampled_->cloud),
        tree_(sampled_->windows),
        options_(options),
        stop_(context.stop),
        memory_(working_memory(context) / 2) {
    const stream::Store& store = cloud_.store;
    const auto threads =
        std::clamp<std::uint64_t>(memory_ / kThreadBytes, 1, std::max(1U, context.threads));
    workers_.resize(threads);
    const std::uint64_t bytes = std::max(memory_ / threads, 2 * kReadBytes) - kReadBytes;
    room_ = static_cast<std::size_t>(bytes / PointCells::kBytesPerPoint);
    const double total = tree_.part(0).points;
    most_points_ =
        std::min({static_cast<double>(bytes) / kBytesPerExpected, kMaxPointsAtOnce,
                  std::max(65536.0, total / (kPartsPerThread * static_cast<double>(threads)))});
    const WantedClusters& wanted = cloud_.wanted;
    const double met = points_met_by_a_place(store, wanted.level());
    points_per_place_ = kPointsPerPlace + kReadShare * met;
    may_load_all_ = !wanted.is_mixed() &&
                    store.levels()[wanted.level()].points * PointCells::kBytesPerPoint <= memory_;
    if (options.max_edge) too_long_ = longer_than(store, *options.max_edge);
  }

  void sample(std::span<const Point2> places, std::span<SurfacePoint> out) override {
    std::fill(out.begin(), out.end(), SurfacePoint{});
    if (cloud_.hull.corners().empty()) return;
    sort_by_window(places);
    if (may_load_all_ && !all_cells_ && is_dense(tree_.part(0), order_.size())) load_all();
    std::vector<const WindowTree::Part*> parts;
    const auto takes = [&](const WindowTree::Part& part) {
      const std::size_t count = numbers_in(part).size();
      return count == 0 || (part.points <= most_points_ && (all_cells_ || is_dense(part, count)));
    };
    tree_.for_each_part(takes, [&](const WindowTree::Part& part) {
      if (!numbers_in(part).empty()) parts.push_back(&part);
    });
    parallel_for(
        parts.size(), static_cast<unsigned>(workers_.size()),
        [&](std::size_t i, unsigned thread) {
          std::unique_ptr<CloudWorker>& worker = workers_[thread];
          if (worker == nullptr) {
            worker = std::make_unique<CloudWorker>(cloud_, too_long_, memory_ / workers_.size());
          }
          if (all_cells_) {
            worker->surface.share(*all_cells_);
            return answer_along(*worker, parts[i]->box, numbers_in(*parts[i]), places, out);
          }
          work_on(*worker, *parts[i], places, out);
        },
        stop_);
  }

 private:
  using Numbers = std::span<std::uint32_t>;

  /// Whether a place may have an answer.
  [[nodiscard]] bool counts(const Point2& p) const {
    if (options_.method == tri::Interpolation::nearest) {
      return std::isfinite(p[0]) && std::isfinite(p[1]);
    }
    const stream::Box3& all = cloud_.store.bounds();
    return p[0] >= all.min[0] && p[0] <= all.max[0] && p[1] >= all.min[1] && p[1] <= all.max[1];
  }

  /// Fills order_ with the numbers of the places that may have answers, by windows, ascending in
  /// each.
  void sort_by_window(std::span<const Point2> places) {
    constexpr std::uint32_t kNone = 0xFFFFFFFF;
    keys_.assign(places.size(), kNone);
    constexpr std::size_t kPiece = 65536;
    parallel_for((places.size() + kPiece - 1) / kPiece, static_cast<unsigned>(workers_.size()),
                 [&](std::size_t piece) {
                   const std::size_t end = std::min((piece + 1) * kPiece, places.size());
                   for (std::size_t i = piece * kPiece; i < end; ++i) {
                     if (!counts(places[i])) continue;
                     keys_[i] = static_cast<std::uint32_t>(tree_.window_of(places[i]));
                   }
                 },
                 stop_);
    begin_.assign(tree_.size() + 1, 0);
    for (const std::uint32_t key : keys_) {
      if (key != kNone) ++begin_[key + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    order_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (keys_[i] != kNone) order_[next[keys_[i]]++] = static_cast<std::uint32_t>(i);
    }
  }
  Numbers numbers_in(const WindowTree::Part& part) {
    return Numbers(order_).subspan(begin_[part.first], begin_[part.end] - begin_[part.first]);
  }

  [[nodiscard]] bool is_dense(const WindowTree::Part& part, std::size_t places) const {
    return static_cast<double>(places) * points_per_place_ >= part.points;
  }

  /// Loads all points once. Otherwise overlapping clusters would be read for many windows each, and
  /// circles in voids extend beyond windows.
  void load_all() {
    auto cells = std::make_unique<PointCells>();
    may_load_all_ = cells->load_all(cloud_.store, cloud_.wanted.level(),
                                    static_cast<unsigned>(workers_.size()));
    if (may_load_all_) all_cells_ = std::move(cells);
  }

  /// A part that does not fit is divided, because its halves may fit.
  void work_on(CloudWorker& worker, const WindowTree::Part& part, std::span<const Point2> places,
               std::span<SurfacePoint> out) {
    const Numbers numbers = numbers_in(part);
    if (numbers.empty()) return;
    const StoredBox& box = part.box;
    const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
    const double margin =
        std::min(kSampleMargin * std::sqrt(width * height / std::max(part.points, 1.0)),
                 kMaxSampleMargin * std::max(width, height));
    if (is_dense(part, numbers.size())) {
      if (worker.load(box, margin, room_, part.is_window())) {
        return answer_along(worker, box, numbers, places, out);
      }
      // Points may be crowded just outside a window.
      if (part.is_window()) {
        if (!worker.load(box, 0, room_, true)) throw_no_room(part);
        return answer_along(worker, box, numbers, places, out);
      }
    } else if (part.is_window()) {
      return answer_few(worker, part, margin, numbers, places, out);
    }
    work_on(worker, tree_.part(part.below), places, out);
    work_on(worker, tree_.part(part.above), places, out);
  }

  [[noreturn]] void throw_no_room(const WindowTree::Part& part) const {
    const double bytes =
        static_cast<double>(kReadBytes) + part.points * static_cast<double>(kBytesPerExpected);
    const std::uint64_t needed =
        2 * std::max(memory_ + (std::uint64_t{1} << 20), static_cast<std::uint64_t>(bytes));
    throw stream::Error(
        cloud_.store.path().string(),
        stream::message("more than {} are close together, too many for {memory_bytes}",
                        counted(room_, "point")))
        .remedy(stream::message("pass {}M of memory or more, or a coarser {level}",
                                (needed >> 20) + 1));
  }

  void answer_along(CloudWorker& worker, const StoredBox& box, Numbers numbers,
                    std::span<const Point2> places, std::span<SurfacePoint> out) {
    worker.along.clear();
    for (const std::uint32_t i : numbers) {
      worker.along.push_back(place_on_curve(box, places[i]) << 32 | i);
    }
    std::sort(worker.along.begin(), worker.along.end());
    for (const std::uint64_t one : worker.along) {
      cloud_.store.check_stop();
      const auto i = static_cast<std::uint32_t>(one);
      out[i] = answer(worker.surface, places[i]);
    }
  }

  void answer_few(CloudWorker& worker, const WindowTree::Part& window, double margin,
                  Numbers numbers, std::span<const Point2> places, std::span<SurfacePoint> out) {
    const StoredBox& box = window.box;
    const auto part = [&](std::uint32_t i) {
      std::array<double, 2> at{};
      for (std::size_t k = 0; k < 2; ++k) {
        const double size = box.max[k] - box.min[k];
        if (size > 0) at[k] = std::floor((places[i][k] - box.min[k]) / size * kParts);
      }
      return at;
    };
    std::sort(numbers.begin(), numbers.end(),
              [&](std::uint32_t a, std::uint32_t b) { return part(a) < part(b); });
    for (std::size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
      StoredBox around;
      for (; end < numbers.size() && part(numbers[end]) == part(numbers[begin]); ++end) {
        around.include(places[numbers[end]]);
      }
      if (!worker.load(around, margin, room_, true) && !worker.load(around, 0, room_, true)) {
        throw_no_room(window);
      }
      answer_along(worker, around, numbers.subspan(begin, end - begin), places, out);
    }
  }

  SurfacePoint answer(PointSurface& surface, const Point2& place) const {
    switch (options_.method) {
      case tri::Interpolation::linear:
        break;
      case tri::Interpolation::natural_neighbour:
        return surface.natural(place);
      case tri::Interpolation::nearest:
        if (too_long_ && std::isnan(surface.linear(place).height)) return {};
        return options_.gradients ? surface.at_nearest(place)
                                  : SurfacePoint{surface.height(surface.nearest(place))};
    }
    return surface.linear(place);
  }

  std::shared_ptr<SampledCloud> sampled_;
  PointCloud& cloud_;
  const WindowTree& tree_;
  SamplerOptions options_;
  std::stop_token stop_;
  std::uint64_t memory_;
  TooLong too_long_;
  std::vector<std::unique_ptr<CloudWorker>> workers_;
  std::size_t room_ = 0;         ///< the most points that a worker can hold
  double most_points_ = 0;       ///< limit for a part that is loaded in one piece
  double points_per_place_ = 0;  ///< loads a part at once up to this many points per place
  bool may_load_all_ = false;    ///< whether to load all points if there are many places
  std::unique_ptr<const PointCells> all_cells_;
  std::vector<std::uint32_t> keys_, order_;
  std::vector<std::size_t> begin_;  ///< index in order_, by window; then its size
};

}  // namespace

std::unique_ptr<HeightSampler> make_point_sampler(std::shared_ptr<SampledCloud> cloud,
                                                  const SamplerOptions& options,
                                                  const Context& context) {
  return std::make_unique<PointSampler>(std::move(cloud), options, context);
}

}  // namespace terrace::terrain
