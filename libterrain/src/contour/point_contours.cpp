// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include <terrace/base/ordered_work.hpp>

#include "base/available_memory.hpp"
#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "contour/part_lines.hpp"
#include "contour/parts.hpp"
#include "contour/triangles.hpp"
#include "surface/point_window.hpp"
#include "surface/wanted_clusters.hpp"
#include "surface/window_tree.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

/// Memory of one triangulated part. If there is less per thread, fewer threads are used.
constexpr std::uint64_t kBytesPerWindow = std::uint64_t{40} << 20;
/// Several parts are triangulated together, which costs less per point. A point's memory is its
/// share of the triangulation and of the triangles that wait to be drawn.
constexpr double kMaxPointsAtOnce = 1U << 16;
/// Peak memory in bytes per point if all points are one part.
constexpr std::uint64_t kBytesPerPointAlone = 1200;
constexpr double kPartsPerThread = 4;
constexpr double kBytesPerExpected = 3.0 * PointWindow::kBytesPerPoint + 3 * 240;
/// Share of a thread's memory for lines that wait to be drawn. Where levels are denser, triangles
/// wait instead.
constexpr std::uint64_t kShareOfLines = 8;
constexpr std::uint64_t kBytesPerSegment = 64;

using Triangle = ContourTriangles::Triangle;
constexpr std::uint32_t kNoPart = kNoContourPart;

/// For each of several parts, its lines or the triangles that levels cross. Also the crossed
/// triangles without a vertex in an active part.
struct Crossed {
  std::vector<std::variant<PartLines, std::vector<Triangle>>> by_part;
  std::vector<Triangle> strange;
};

bool places_less(const Triangle& s, const Triangle& t) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (s[i].place != t[i].place) return s[i].place < t[i].place;
  }
  return false;
}

class PointContours {
 public:
  explicit PointContours(const ContourParts& parts)
      : parts_(parts),
        request_(parts.request),
        ground_(parts.store),
        wanted_(parts.store, request_.level, request_.focuses),
        by_rows_(parts.store.schema().grid && wanted_.is_mixed()),
        levels_(request_.interval, by_rows_),
        tree_(parts.store, wanted_, parts.points_per_part),
        rank_(tree_.size(), kNoPart),
        is_selective_(request_.max_edge || request_.region ||
                      (parts.store.schema().grid && wanted_.finest() == 0)) {
    const stream::Box3& bounds = parts.store.bounds();
    bounds_ = flat(bounds);
    // Widened, so that a triangle whose rounded middle is in a box meets the box.
    const auto widened = [&](StoredBox box) {
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double margin =
            1e-9 * std::max({std::abs(bounds_.min[axis]), std::abs(bounds_.max[axis]), 1e-300});
        box.min[axis] -= margin;
        box.max[axis] += margin;
      }
      return box;
    };
    const std::optional<Region>& region = request_.region;
    if (region && !widened(box_around(*region, ground_)).intersects(bounds_)) {
      throw_none_inside(parts.store);
    }
    for (std::size_t part = 0; part < tree_.size(); ++part) {
      if (!region || reaches_into(widened(tree_.box(part)), *region, ground_)) {
        rank_[part] = parts_at_work_++;
      }
    }
  }

  void draw() {
    const std::uint64_t memory = parts_.memory_bytes / 2;
    // The order of the lines depends on the parts, so a whole part must fit.
    const std::uint64_t least =
        std::min(kBytesPerWindow,
                 static_cast<std::uint64_t>(wanted_.points(parts_.store)) * kBytesPerPointAlone);
    if (memory < least) {
      throw stream::Error(
          parts_.store.path().string(),
          stream::message("contours of its points need {} of memory, {memory_bytes} allows {}",
                          readable_bytes(kProcessBytes + 2 * least),
                          readable_bytes(kProcessBytes + parts_.memory_bytes)))
          .remedy(stream::message("raise {memory_bytes}, or choose a coarser {level}"));
    }
    const auto threads = static_cast<unsigned>(
        std::clamp<std::uint64_t>(memory / kBytesPerWindow, 1, parts_.threads));
    max_segments_ = memory / threads / kShareOfLines / kBytesPerSegment;
    const double max_points =
        std::min({static_cast<double>(memory / threads) / kBytesPerExpected, kMaxPointsAtOnce,
                  tree_.part(0).points / (kPartsPerThread * threads)});
    std::vector<const WindowTree::Part*> loads;
    tree_.for_each_part([&](const WindowTree::Part& part) { return part.points <= max_points; },
                        [&](const WindowTree::Part& part) {
                          if (first_at_work(part) < part.end) loads.push_back(&part);
                        });
    PointCloud cloud(parts_.store, wanted_);
    std::vector<std::unique_ptr<PointWindow>> windows(threads);
    ContourTriangles lines(request_.interval, parts_.emit, parts_.limit, by_rows_);
    std::vector<Triangle> strange;
    base::in_order(
        loads.size(), threads,
        [&](unsigned thread, std::size_t i) {
          std::unique_ptr<PointWindow>& window = windows[thread];
          if (window == nullptr) {
            window = std::make_unique<PointWindow>(cloud, memory / threads);
          }
          Crossed result;
          add_crossed(*window, *loads[i], result);
          ContourTriangles::sort(result.strange);
          return result;
        },
        [&](std::size_t i, const Crossed& triangles) {
          for (const auto& part : triangles.by_part) {
            std::visit([&](const auto& of_part) { lines.add(of_part); }, part);
          }
          // Several parts meet such a triangle.
          const auto middle =
              strange.insert(strange.end(), triangles.strange.begin(), triangles.strange.end());
          std::inplace_merge(strange.begin(), middle, strange.end(), places_less);
          strange.erase(std::unique(strange.begin(), strange.end(),
                                    [](const Triangle& s, const Triangle& t) {
                                      return !places_less(s, t) && !places_less(t, s);
                                    }),
                        strange.end());
          parts_.progress(static_cast<double>(i + 1) / static_cast<double>(loads.size()));
        });
    lines.finish(strange);
  }

 private:
  [[nodiscard]] bool is_wanted(const Triangle& t) const {
    for (std::size_t i = 0; request_.max_edge && i < 3; ++i) {
      if (ground_.metres(t[i].place, t[(i + 1) % 3].place) > *request_.max_edge) return false;
    }
    Point2 middle{};
    bool is_lattice_triangle = true;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double a = t[0].place[axis], b = t[1].place[axis], c = t[2].place[axis];
      middle[axis] = (a + b + c) / 3;
      is_lattice_triangle = is_lattice_triangle && std::max({a, b, c}) - std::min({a, b, c}) <= 1;
    }
    // Where all samples are wanted, other triangles of a raster span missing samples.
    const bool spans_missing =
        parts_.store.schema().grid && !is_lattice_triangle && wanted_.has_all_samples(middle, 1);
    if (spans_missing) return false;
    return !request_.region || request_.region->covers(ground_.world(middle));
  }

  /// Returns part.end if none is active.
  [[nodiscard]] std::size_t first_at_work(const WindowTree::Part& part) const {
    std::size_t first = part.first;
    while (first < part.end && rank_[first] == kNoPart) ++first;
    return first;
  }

  /// A part that does not fit is divided, because its halves may fit.
  void add_crossed(PointWindow& window, const WindowTree::Part& part, Crossed& result) const {
    if (first_at_work(part) == part.end) return;
    try {
      window.load(part.box);
    } catch (const PointWindow::NoRoom&) {
      if (part.is_window()) throw;
      add_crossed(window, tree_.part(part.below), result);
      add_crossed(window, tree_.part(part.above), result);
      return;
    }
    const tri::Delaunay2<double>& delaunay = window.triangulation();
    std::vector<std::int64_t> level_of(delaunay.vertex_slots());
    std::vector<std::uint32_t> part_of(delaunay.vertex_slots());
    for (const tri::VertexId vertex : delaunay.all_vertices()) {
      level_of[tri::slot(vertex)] = levels_.at_or_above(window.height(vertex));
      part_of[tri::slot(vertex)] = rank_[tree_.window_of(delaunay.point(vertex))];
    }
    const auto triangle_of = [&](tri::TriangleId id) {
      Triangle triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        const tri::VertexId v = delaunay.vertices(id)[i];
        triangle[i] = {delaunay.point(v), window.height(v), level_of[tri::slot(v)],
                       part_of[tri::slot(v)]};
      }
      return triangle;
    };
    // The parts in a box have consecutive ranks.
    const std::uint32_t first_rank = rank_[first_at_work(part)];
    std::uint32_t count = 0;
    for (std::size_t i = part.first; i < part.end; ++i) count += rank_[i] != kNoPart ? 1U : 0U;
    std::vector<std::vector<tri::TriangleId>> by_part(count);
    std::uint64_t segments = 0;
    for (const tri::TriangleId id : delaunay.all_triangles()) {
      const std::array<tri::VertexId, 3> vertices = delaunay.vertices(id);
      const auto level = [&](std::size_t i) { return level_of[tri::slot(vertices[i])]; };
      if (level(0) == level(1) && level(0) == level(2)) continue;
      const auto at = [&](std::size_t i) { return part_of[tri::slot(vertices[i])]; };
      const std::uint32_t first = std::min({at(0), at(1), at(2)});
      const bool is_own = first != kNoPart && first - first_rank < count;
      if ((!is_own && first != kNoPart) || !window.is_certain(id)) continue;
      if (is_selective_ && !is_wanted(triangle_of(id))) continue;
      if (is_own) {
        by_part[first - first_rank].push_back(id);
        const auto [low, high] = std::minmax({level(0), level(1), level(2)});
        segments += static_cast<std::uint64_t>(high - low);
      } else {
        result.strange.push_back(triangle_of(id));
      }
    }
    if (segments <= max_segments_) {
      PartTracer tracer(levels_, delaunay, window.heights(), level_of, part_of);
      for (const auto& ids : by_part) result.by_part.emplace_back(tracer.trace(ids));
    } else {
      for (const auto& ids : by_part) {
        std::vector<Triangle> triangles;
        for (const tri::TriangleId id : ids) triangles.push_back(triangle_of(id));
        ContourTriangles::sort(triangles);
        result.by_part.emplace_back(std::move(triangles));
      }
    }
  }

  const ContourParts& parts_;
  const ContourRequest& request_;
  GroundSlope ground_;
  WantedClusters wanted_;
  bool by_rows_;  ///< as in ContourLevels: lines in focuses of a raster are those of its lattice
  ContourLevels levels_;
  WindowTree tree_;
  StoredBox bounds_;
  std::vector<std::uint32_t> rank_;  ///< by part: its number among the parts that meet the region
  std::uint32_t parts_at_work_ = 0;
  bool is_selective_;               ///< whether some triangles are not wanted
  std::uint64_t max_segments_ = 0;  ///< limit of segments waiting in parts triangulated together
};

}  // namespace

void draw_point_contours(const ContourParts& parts) {
  if (parts.store.points() == 0) {
    if (parts.request.region) throw_none_inside(parts.store);
    return;
  }
  PointContours(parts).draw();
}

}  // namespace terrace::terrain
