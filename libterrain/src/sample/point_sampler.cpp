// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/tri/interpolation.hpp>

#include "base/parallel.hpp"
#include "sample/nearest_point.hpp"
#include "sample/samplers.hpp"
#include "surface/ground_slope.hpp"
#include "surface/point_window.hpp"
#include "surface/window_tree.hpp"

namespace terrace::terrain {
namespace {

/// Windows of the tree. What is loaded at once are as many of them as pay.
constexpr std::size_t kWindowPoints = 16384;
/// Above this a triangulation gets slower per point, and threads wait for the last one.
constexpr double kMostPointsAtOnce = 1U << 21;
constexpr double kPartsPerThread = 4;
/// A place alone costs as much as to triangulate so many points, and to read all clusters whose
/// boxes hold it, which costs per point a twelfth of that.
constexpr double kPointsPerPlace = 2000;
constexpr double kReadShare = 1.0 / 12;
/// Where places are too few, what lies around those that fall into a box so many times smaller
/// than a window, to each side, is loaded.
constexpr double kParts = 8;
constexpr std::uint64_t kCloudCacheBytes = std::uint64_t{4} << 20;
/// What a thread may need: a window of usual size where points crowd.
constexpr std::uint64_t kThreadBytes = std::uint64_t{32} << 20;
/// Points may be half as many again as expected, and others are read around.
constexpr double kBytesPerExpected = 2.0 * PointWindow::kBytesPerPoint;

/// Along a curve through the box, so that the next place is near as a rule.
std::uint64_t place_on_curve(const StoredBox& box, const Point2& place) {
  std::uint64_t at = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double size = box.max[k] - box.min[k];
    const double share = size > 0 ? (place[k] - box.min[k]) / size : 0.0;
    auto bits = static_cast<std::uint64_t>(std::clamp(share, 0.0, 1.0) * 65535);
    bits = (bits | bits << 8) & 0x00FF00FFU;
    bits = (bits | bits << 4) & 0x0F0F0F0FU;
    bits = (bits | bits << 2) & 0x33333333U;
    bits = (bits | bits << 1) & 0x55555555U;
    at |= bits << k;
  }
  return at;
}

/// How many points the clusters have whose boxes hold a place: few where points came in order.
double points_met_by_a_place(const stream::Store& store, unsigned level) {
  const auto area = [](const stream::Box3& box) {
    return (box.max[0] - box.min[0]) * (box.max[1] - box.min[1]);
  };
  const double whole = area(store.bounds());
  const stream::LevelInfo& info = store.levels()[level];
  if (level == store.top() || !(whole > 0)) return 0;
  constexpr std::uint64_t kLookedAt = 500;
  const std::uint64_t count = std::min(info.clusters, kLookedAt);
  double sum = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t ordinal = i * info.clusters / count;
    sum += area(store.record(stream::cluster_id(level, ordinal)).summary.box);
  }
  return static_cast<double>(info.points) * sum / static_cast<double>(count) / whole;
}

/// What one thread works with.
struct CloudWorker {
  PointWindow window;
  std::optional<NearestPoint> nearest{};
  std::vector<Point2> places{};
  std::vector<std::uint64_t> along{};  ///< places on a curve, and their numbers

  /// Unless it is the last one anyhow.
  void load(const StoredBox& box, PointWindow::Reach reach) {
    if (loaded_ && loaded_->first.min == box.min && loaded_->first.max == box.max &&
        loaded_->second == reach) {
      return;
    }
    loaded_.reset();
    window.load(box, reach);
    loaded_ = {box, reach};
  }

  CloudWorker(const stream::Store& store, unsigned level, std::uint64_t memory_bytes)
      : window(store, level, memory_bytes) {}

 private:
  std::optional<std::pair<StoredBox, PointWindow::Reach>> loaded_{};
};

class PointSampler final : public HeightSampler {
 public:
  PointSampler(const stream::Store& store, const SamplerOptions& options, const Context& context)
      : store_(store), options_(options), tree_(store, options.level, kWindowPoints) {
    const std::uint64_t memory = context.memory_or(0) / 2;
    const auto threads =
        std::clamp<std::uint64_t>(memory / kThreadBytes, 1, std::max(1U, context.threads));
    workers_.resize(threads);
    worker_bytes_ = memory / threads;
    const double whole = tree_.part(0).points;
    most_points_ =
        std::min({static_cast<double>(worker_bytes_) / kBytesPerExpected, kMostPointsAtOnce,
                  std::max(65536.0, whole / (kPartsPerThread * static_cast<double>(threads)))});
    points_per_place_ = kPointsPerPlace + kReadShare * points_met_by_a_place(store, options.level);
    if (options.max_edge) too_long_ = longer_than(store, *options.max_edge);
  }

  void sample(std::span<const Point2> places, std::span<SurfacePoint> out) override {
    std::fill(out.begin(), out.end(), SurfacePoint{});
    if (options_.method != tri::Interpolation::kNearest) {
      return answer(places, out, options_.method);
    }
    if (too_long_) answer(places, out, tri::Interpolation::kLinear);
    nearest_.assign(places.size(), Point2{NAN, NAN});
    find_nearest(places, out);
    std::fill(out.begin(), out.end(), SurfacePoint{});
    answer(nearest_, out, tri::Interpolation::kLinear);
  }

 private:
  using Numbers = std::span<std::uint32_t>;

  [[nodiscard]] bool inside(const Point2& p) const {
    const stream::Box3& all = store_.bounds();
    return p[0] >= all.min[0] && p[0] <= all.max[0] && p[1] >= all.min[1] && p[1] <= all.max[1];
  }

  /// Fills order_ with the numbers of the places that count, by windows, ascending within one.
  template <class Counts>
  void sort_by_window(std::span<const Point2> places, const Counts& counts) {
    constexpr std::uint32_t kNone = 0xFFFFFFFF;
    keys_.assign(places.size(), kNone);
    constexpr std::size_t kPiece = 65536;
    parallel_for((places.size() + kPiece - 1) / kPiece, static_cast<unsigned>(workers_.size()),
                 [&](unsigned, std::size_t piece) {
                   const std::size_t end = std::min((piece + 1) * kPiece, places.size());
                   for (std::size_t i = piece * kPiece; i < end; ++i) {
                     if (!counts(i)) continue;
                     keys_[i] = static_cast<std::uint32_t>(tree_.window_of(places[i]));
                   }
                 });
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

  /// Calls work(worker, part, numbers) for parts that fit into memory and have places enough to be
  /// loaded as a whole, and for windows.
  template <class Work>
  void for_each_part(double most_points, const Work& work) {
    std::vector<const WindowTree::Part*> parts;
    const auto takes = [&](const WindowTree::Part& part) {
      const std::size_t places = numbers_in(part).size();
      return places == 0 || (part.points <= most_points && is_dense(part, places));
    };
    tree_.for_each_part(takes, [&](const WindowTree::Part& part) {
      if (!numbers_in(part).empty()) parts.push_back(&part);
    });
    parallel_for(parts.size(), static_cast<unsigned>(workers_.size()),
                 [&](unsigned thread, std::size_t i) {
                   std::unique_ptr<CloudWorker>& worker = workers_[thread];
                   if (worker == nullptr) {
                     worker = std::make_unique<CloudWorker>(store_, options_.level, worker_bytes_);
                     worker->window.set_limit(too_long_);
                   }
                   work_on(*worker, *parts[i], work);
                 });
  }
  /// If it does not fit after all, its halves may.
  template <class Work>
  void work_on(CloudWorker& worker, const WindowTree::Part& part, const Work& work) {
    const Numbers numbers = numbers_in(part);
    if (numbers.empty()) return;
    if (part.is_window() || is_dense(part, numbers.size())) {
      try {
        return work(worker, part, numbers);
      } catch (const PointWindow::NoRoom&) {
        if (part.is_window()) throw;
      }
    }
    work_on(worker, tree_.part(part.below), work);
    work_on(worker, tree_.part(part.above), work);
  }

  void answer(std::span<const Point2> places, std::span<SurfacePoint> out,
              tri::Interpolation method) {
    sort_by_window(places, [&](std::size_t i) { return inside(places[i]); });
    if (method == tri::Interpolation::kNaturalNeighbour) {
      // Always by windows: the last bits depend on them.
      for_each_part(0, [&](CloudWorker& worker, const WindowTree::Part& part, Numbers numbers) {
        worker.load(part.box, PointWindow::Reach::kCircles);
        answer_natural(worker, numbers, places, out);
      });
      return;
    }
    for_each_part(most_points_,
                  [&](CloudWorker& worker, const WindowTree::Part& part, Numbers numbers) {
                    if (!is_dense(part, numbers.size())) {
                      return answer_few(worker, part.box, numbers, places, out);
                    }
                    worker.load(part.box, PointWindow::Reach::kTriangles);
                    for_each_along(worker, part.box, numbers, places,
                                   [&](std::uint32_t i) { out[i] = worker.window.at(places[i]); });
                  });
  }

  /// Calls visit(number) for all numbers, along a curve.
  template <class Visit>
  static void for_each_along(CloudWorker& worker, const StoredBox& box, Numbers numbers,
                             std::span<const Point2> places, const Visit& visit) {
    worker.along.clear();
    for (const std::uint32_t i : numbers) {
      worker.along.push_back(place_on_curve(box, places[i]) << 32 | i);
    }
    std::sort(worker.along.begin(), worker.along.end());
    for (const std::uint64_t one : worker.along) visit(static_cast<std::uint32_t>(one));
  }

  static void answer_few(CloudWorker& worker, const StoredBox& box, Numbers numbers,
                         std::span<const Point2> places, std::span<SurfacePoint> out) {
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
      StoredBox around{places[numbers[begin]], places[numbers[begin]]};
      for (; end < numbers.size() && part(numbers[end]) == part(numbers[begin]); ++end) {
        for (std::size_t k = 0; k < 2; ++k) {
          around.min[k] = std::min(around.min[k], places[numbers[end]][k]);
          around.max[k] = std::max(around.max[k], places[numbers[end]][k]);
        }
      }
      worker.load(around, PointWindow::Reach::kTriangles);
      for (std::size_t i = begin; i < end; ++i) {
        out[numbers[i]] = worker.window.at(places[numbers[i]]);
      }
    }
  }

  void answer_natural(CloudWorker& worker, Numbers numbers, std::span<const Point2> places,
                      std::span<SurfacePoint> out) const {
    const PointWindow& window = worker.window;
    const auto& triangulation = window.triangulation();
    if (triangulation.vertex_count() == 0) return;
    worker.places.clear();
    for (const std::uint32_t i : numbers) worker.places.push_back(places[i]);
    const auto heights = tri::heights_at(triangulation, window.heights(), worker.places,
                                         tri::Interpolation::kNaturalNeighbour, 1);
    const auto gradients = tri::gradients_at(triangulation, window.heights(), worker.places,
                                             tri::GradientFrom::kNaturalNeighbours, 1);
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const std::uint32_t i = numbers[k];
      if (too_long_ && std::isnan(window.at(places[i]).height)) continue;
      if (window.is_on_edge(places[i])) {
        // Which of two triangles is found depends on where the search began, and with it the last
        // bit: alone it always begins at the same.
        const std::span<const Point2> one(&places[i], 1);
        const double height = tri::heights_at(triangulation, window.heights(), one,
                                              tri::Interpolation::kNaturalNeighbour, 1)[0];
        const tri::Gradient gradient = tri::gradients_at(
            triangulation, window.heights(), one, tri::GradientFrom::kNaturalNeighbours, 1)[0];
        out[i] = {height, gradient.x, gradient.y};
      } else {
        out[i] = {heights[k], gradients[k].x, gradients[k].y};
      }
    }
  }

  /// nearest_ of all places, or of those that have an answer where there is a limit.
  void find_nearest(std::span<const Point2> places, std::span<const SurfacePoint> answers) {
    sort_by_window(places, [&](std::size_t i) {
      return std::isfinite(places[i][0]) && std::isfinite(places[i][1]) &&
             (!too_long_ || !std::isnan(answers[i].height));
    });
    for_each_part(0, [&](CloudWorker& worker, const WindowTree::Part& part, Numbers numbers) {
      if (!worker.nearest) worker.nearest.emplace(store_, options_.level, kCloudCacheBytes);
      for_each_along(worker, part.box, numbers, places,
                     [&](std::uint32_t i) { nearest_[i] = (*worker.nearest)(places[i]); });
    });
  }

  stream::Store store_;
  SamplerOptions options_;
  WindowTree tree_;
  PointWindow::TooLong too_long_;
  std::vector<std::unique_ptr<CloudWorker>> workers_;
  std::uint64_t worker_bytes_ = 0;
  double most_points_ = 0;       ///< of a part that is loaded as a whole
  double points_per_place_ = 0;  ///< for which it pays
  std::vector<std::uint32_t> keys_, order_;
  std::vector<std::size_t> begin_;  ///< in order_, by window; at last its size
  std::vector<Point2> nearest_;
};

}  // namespace

std::unique_ptr<HeightSampler> make_point_sampler(const stream::Store& store,
                                                  const SamplerOptions& options,
                                                  const Context& context) {
  return std::make_unique<PointSampler>(store, options, context);
}

}  // namespace terrace::terrain
