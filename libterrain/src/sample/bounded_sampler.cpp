// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <terrace/tri/predicates.hpp>

#include "base/available_memory.hpp"
#include "base/parallel.hpp"
#include "base/store_checks.hpp"
#include "sample/samplers.hpp"
#include "surface/bounded/bounded_surface.hpp"
#include "surface/corner.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Returns the surface at a place from all triangles that contain it. Requires at least one.
SurfacePoint on_triangles(const Point2& place, std::span<SurfaceTriangle> triangles) {
  for (const SurfaceTriangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (t[i].place == place) return where_triangles_meet(place, t[i].height, triangles, {});
    }
  }
  const SurfaceTriangle& t = triangles.front();
  for (std::size_t i = 0; i < 3; ++i) {
    const SurfaceCorner &a = t[i], &b = t[(i + 1) % 3];
    if (tri::orientation(a.place, b.place, place) == 0) {
      return where_triangles_meet(place, on_edge(a, b, place), triangles, {});
    }
  }
  return on_plane(t, place);
}

class BoundedSampler final : public HeightSampler {
 public:
  BoundedSampler(const stream::Store& store, std::shared_ptr<BoundedParts> surface,
                 const SamplerOptions& options, const Context& context)
      : parts_(std::move(surface)),
        stop_(context.stop),
        threads_(parts_->surface().threads_within(working_memory(context) / 2, context.threads)) {
    const stream::StoreSchema& schema = store.schema();
    const bool is_full = schema.columns > 1 && schema.rows > 1 && store.condition() == nullptr &&
                         store.points() == schema.columns * schema.rows;
    if (!schema.grid || is_full) return;
    Context quarter = context;
    quarter.memory_bytes = kProcessBytes + working_memory(context) / 4;
    SamplerOptions exact = options;
    exact.max_error.reset();
    lattice_ = make_lattice_sampler(store, exact, quarter);
  }

  void sample(std::span<const Point2> places, std::span<SurfacePoint> out) override {
    if (lattice_) {
      lattice_->sample(places, out);
    } else {
      std::fill(out.begin(), out.end(), SurfacePoint{});
    }
    sort_by_window(places, out);
    std::vector<std::vector<Meeting>> meetings(groups_.size());
    parallel_for(
        groups_.size(), threads_,
        [&](std::size_t i) {
          const std::shared_ptr<const BoundedPart> part =
              (*parts_)(asked_[groups_[i].begin].window);
          std::vector<SurfaceTriangle> triangles;
          for (std::size_t k = groups_[i].begin; k < groups_[i].end; ++k) {
            const Asked& asked = asked_[k];
            triangles.clear();
            part->append_at(places[asked.place], triangles);
            if (asked.is_on_side) {
              for (const SurfaceTriangle& t : triangles) meetings[i].push_back({asked.place, t});
            } else if (!triangles.empty()) {
              out[asked.place] = on_triangles(places[asked.place], triangles);
            }
          }
        },
        stop_);
    answer_on_sides(meetings, places, out);
  }

 private:
  /// A place in a window.
  struct Asked {
    std::uint32_t window = 0, place = 0;
    bool is_on_side = false;  ///< other windows contain it too
  };
  struct Group {
    std::size_t begin = 0, end = 0;  ///< range in asked_, all in one window
  };
  /// A triangle that contains a place on a side.
  struct Meeting {
    std::uint32_t place = 0;
    SurfaceTriangle triangle;
  };

  void sort_by_window(std::span<const Point2> places, std::span<const SurfacePoint> exact) {
    asked_.clear();
    std::vector<std::uint32_t> windows;
    for (std::size_t i = 0; i < places.size(); ++i) {
      // Missing samples leave the same gaps as at level 0.
      if (lattice_ && std::isnan(exact[i].height)) continue;
      windows.clear();
      parts_->surface().append_windows_at(places[i], windows);
      for (const std::uint32_t window : windows) {
        asked_.push_back({window, static_cast<std::uint32_t>(i), windows.size() > 1});
      }
    }
    std::sort(asked_.begin(), asked_.end(), [](const Asked& a, const Asked& b) {
      return a.window != b.window ? a.window < b.window : a.place < b.place;
    });
    groups_.clear();
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      if (k == 0 || asked_[k].window != asked_[k - 1].window) groups_.push_back({k, k});
      groups_.back().end = k + 1;
    }
  }

  static void answer_on_sides(const std::vector<std::vector<Meeting>>& meetings,
                              std::span<const Point2> places, std::span<SurfacePoint> out) {
    std::vector<Meeting> all;
    for (const auto& of_window : meetings) {
      all.insert(all.end(), of_window.begin(), of_window.end());
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Meeting& a, const Meeting& b) { return a.place < b.place; });
    std::vector<SurfaceTriangle> triangles;
    for (std::size_t k = 0; k < all.size();) {
      const std::uint32_t place = all[k].place;
      triangles.clear();
      for (; k < all.size() && all[k].place == place; ++k) triangles.push_back(all[k].triangle);
      out[place] = on_triangles(places[place], triangles);
    }
  }

  std::shared_ptr<BoundedParts> parts_;
  std::stop_token stop_;
  unsigned threads_;
  /// For rasters with missing samples: the surface of level 0, which has the same gaps. Where it
  /// has a height but no triangle of few samples does, its height counts.
  std::unique_ptr<HeightSampler> lattice_;
  std::vector<Asked> asked_;
  std::vector<Group> groups_;
};

}  // namespace

std::shared_ptr<BoundedParts> sampled_surface(const stream::Store& store,
                                              const SamplerOptions& options,
                                              const Context& context) {
  if (!options.max_error) return nullptr;
  need_terrain(store, "the height of a place");
  need_bound_alone(options.level, options.focuses, options.max_edge);
  if (options.method != tri::Interpolation::linear) {
    throw UsageError(stream::message(
        "{max_error} gives heights of triangles: leave the {method} of interpolation out"));
  }
  return std::make_shared<BoundedParts>(
      bounded_surface(store.with_stop(context.stop), *options.max_error),
      working_memory(context) / 8);
}

std::unique_ptr<HeightSampler> make_bounded_sampler(const stream::Store& store,
                                                    std::shared_ptr<BoundedParts> surface,
                                                    const SamplerOptions& options,
                                                    const Context& context) {
  return std::make_unique<BoundedSampler>(store.with_stop(context.stop), std::move(surface),
                                          options, context);
}

}  // namespace terrace::terrain
