// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/tri/interpolation.hpp>

#include "base/parallel.hpp"
#include "sample/height_sampler.hpp"
#include "sample/nearest_point.hpp"
#include "surface/ground_slope.hpp"
#include "surface/point_window.hpp"
#include "surface/window_tree.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kWindowPoints = 16384;
/// Of windows with fewer places only what lies around these is loaded, in parts that are so many
/// times smaller to each side.
constexpr std::size_t kFewPlaces = 100;
constexpr double kParts = 8;
constexpr std::uint64_t kCloudCacheBytes = std::uint64_t{4} << 20;
/// What a thread may need: a window of usual size where points crowd.
constexpr std::uint64_t kThreadBytes = std::uint64_t{32} << 20;

/// What one thread works with.
struct CloudWorker {
  PointWindow window;
  std::optional<NearestPoint> nearest{};
  std::vector<Point2> places{};

  /// Unless it is the last one anyhow.
  void load(const WindowTree& tree, std::size_t number, PointWindow::Reach reach) {
    if (loaded_ == std::pair(number, reach)) return;
    loaded_.reset();
    window.load(tree.box(number), reach);
    loaded_ = {number, reach};
  }
  void load(const StoredBox& box) {
    loaded_.reset();
    window.load(box);
  }

  CloudWorker(const stream::Store& store, unsigned level, std::uint64_t memory_bytes)
      : window(store, level, memory_bytes) {}

 private:
  std::optional<std::pair<std::size_t, PointWindow::Reach>> loaded_{};
};

class PointSampler final : public HeightSampler {
 public:
  PointSampler(const stream::Store& store, const SamplerOptions& options)
      : store_(store), options_(options), tree_(store, options.level, kWindowPoints) {
    const std::uint64_t memory = options.memory_bytes / 2;
    const auto threads =
        std::clamp<std::uint64_t>(memory / kThreadBytes, 1, std::max(1U, options.threads));
    workers_.resize(threads);
    worker_bytes_ = memory / threads;
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
  /// Places of one window.
  struct Part {
    std::size_t window = 0, begin = 0, end = 0;  ///< in order_
  };

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
    std::vector<std::size_t> next(tree_.size() + 1, 0);
    for (const std::uint32_t key : keys_) next[key == kNone ? tree_.size() : key]++;
    std::size_t begin = 0;
    parts_.clear();
    for (std::size_t window = 0; window < tree_.size(); ++window) {
      const std::size_t count = std::exchange(next[window], begin);
      if (count > 0) parts_.push_back({window, begin, begin + count});
      begin += count;
    }
    order_.resize(begin);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (keys_[i] != kNone) order_[next[keys_[i]]++] = static_cast<std::uint32_t>(i);
    }
  }

  template <class Work>
  void for_each_part(const Work& work) {
    parallel_for(
        parts_.size(), static_cast<unsigned>(workers_.size()), [&](unsigned thread, std::size_t i) {
          std::unique_ptr<CloudWorker>& worker = workers_[thread];
          if (worker == nullptr) {
            worker = std::make_unique<CloudWorker>(store_, options_.level, worker_bytes_);
            worker->window.set_limit(too_long_);
          }
          const Part& part = parts_[i];
          work(*worker, part.window, Numbers(order_.data() + part.begin, part.end - part.begin));
        });
  }

  void answer(std::span<const Point2> places, std::span<SurfacePoint> out,
              tri::Interpolation method) {
    sort_by_window(places, [&](std::size_t i) { return inside(places[i]); });
    for_each_part([&](CloudWorker& worker, std::size_t window, Numbers numbers) {
      if (method == tri::Interpolation::kNaturalNeighbour) {
        // Always the whole window: the last bits depend on it.
        worker.load(tree_, window, PointWindow::Reach::kCircles);
        answer_natural(worker, numbers, places, out);
      } else if (numbers.size() >= kFewPlaces) {
        worker.load(tree_, window, PointWindow::Reach::kTriangles);
        for (const std::uint32_t i : numbers) out[i] = worker.window.at(places[i]);
      } else {
        answer_few(worker, tree_.box(window), numbers, places, out);
      }
    });
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
      worker.load(around);
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
    for_each_part([&](CloudWorker& worker, std::size_t, Numbers numbers) {
      if (!worker.nearest) worker.nearest.emplace(store_, options_.level, kCloudCacheBytes);
      for (const std::uint32_t i : numbers) nearest_[i] = (*worker.nearest)(places[i]);
    });
  }

  const stream::Store& store_;
  SamplerOptions options_;
  WindowTree tree_;
  PointWindow::TooLong too_long_;
  std::vector<std::unique_ptr<CloudWorker>> workers_;
  std::uint64_t worker_bytes_ = 0;
  std::vector<std::uint32_t> keys_, order_;
  std::vector<Part> parts_;
  std::vector<Point2> nearest_;
};

}  // namespace

std::unique_ptr<HeightSampler> make_point_sampler(const stream::Store& store,
                                                  const SamplerOptions& options) {
  return std::make_unique<PointSampler>(store, options);
}

}  // namespace terrace::terrain
