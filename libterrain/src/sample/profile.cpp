// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/tri/predicates.hpp>

#include "base/available_memory.hpp"
#include "base/decimal_multiples.hpp"
#include "base/file_marks.hpp"
#include "base/fixed_text.hpp"
#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "earth/ground.hpp"
#include "earth/line_distance.hpp"
#include "sample/lattice_crossings.hpp"
#include "sample/samplers.hpp"
#include "surface/bounded/bounded_surface.hpp"
#include "surface/corner.hpp"
#include "surface/ground_slope.hpp"
#include "surface/point_window.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kRowsAtOnce = 65536;
/// Longer profiles are refused, because writing them would practically never end.
constexpr double kMaxRows = 1e9;

Point2 between(const Point2& a, const Point2& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
}

/// A line is followed in pieces of this share of a window's size, because boxes around slanting
/// pieces cover more than the pieces.
constexpr double kCrossingPiece = 0.5;
/// Share of the line within which two crossings are the same; rounding may separate them.
constexpr double kSameCrossing = 1e-12;

/// Returns the part of the line in the box, or slightly more; begin > end if there is none.
std::array<double, 2> part_within(const StoredBox& box, const Point2& from, const Point2& to) {
  double begin = 0, end = 1;
  for (std::size_t k = 0; k < 2; ++k) {
    const double way = to[k] - from[k];
    if (way == 0) {
      if (from[k] < box.min[k] || from[k] > box.max[k]) return {1, 0};
      continue;
    }
    const double first = (box.min[k] - from[k]) / way, second = (box.max[k] - from[k]) / way;
    begin = std::max(begin, std::min(first, second) - kSameCrossing);
    end = std::min(end, std::max(first, second) + kSameCrossing);
  }
  return {begin, end};
}

/// A place where a line crosses an edge of a triangle.
struct SurfaceCrossing {
  double t = 0;    ///< position along the line, between 0 and 1
  Point2 place{};  ///< stored
  /// Height of the linear surface; NaN on edges longer than SamplerOptions::max_edge, and where
  /// the sampler determines it.
  double height{};
};
using VisitCrossing = std::function<void(const SurfaceCrossing&)>;

/// Calls visit for each crossing between stored places `from` and `to`, in order, once per vertex;
/// crossings closer than 1e-12 of the line are one. Exact predicates decide on which side of the
/// line the ends of an edge are, so no crossing is missed. Throws: stream::Error, stream::Stopped.
using FindCrossings =
    std::function<void(const Point2& from, const Point2& to, const VisitCrossing& visit)>;

/// Calls add(place, a, b, share) where the line from `from` to `to` crosses the edge from corner a
/// to b, at this share of it, and add(place, a, a, 0) where it meets corner a.
template <class Add>
void cross_triangle(const SurfaceTriangle& corner, const Point2& from, const Point2& to,
                    const Add& add) {
  std::array<int, 3> side{};
  for (std::size_t i = 0; i < 3; ++i) side[i] = tri::orientation(from, to, corner[i].place);
  if (side[0] == side[1] && side[1] == side[2]) return;
  const double dx = to[0] - from[0], dy = to[1] - from[1];
  const auto off = [&](const Point2& p) {
    return std::abs(dx * (p[1] - from[1]) - dy * (p[0] - from[0]));
  };
  for (std::size_t i = 0; i < 3; ++i) {
    std::size_t p = i, q = (i + 1) % 3;
    if (side[p] == 0) add(corner[p].place, corner[p], corner[p], 0.0);
    if (side[p] * side[q] >= 0) continue;
    if (corner[q].place < corner[p].place) std::swap(p, q);
    const SurfaceCorner &c = corner[p], &d = corner[q];
    const double left = off(c.place), right = off(d.place);
    const double share = left + right > 0 ? left / (left + right) : 0.5;
    add(between(c.place, d.place, share), c, d, share);
  }
}

/// Returns the position of a place near the line from `from` to `to` along it.
double along(const Point2& from, const Point2& to, const Point2& place) {
  const double dx = to[0] - from[0], dy = to[1] - from[1];
  return (dx * (place[0] - from[0]) + dy * (place[1] - from[1])) / (dx * dx + dy * dy);
}

void sort_crossings(std::vector<SurfaceCrossing>& crossings) {
  std::sort(crossings.begin(), crossings.end(),
            [](const SurfaceCrossing& p, const SurfaceCrossing& q) {
              return p.t != q.t ? p.t < q.t : p.place < q.place;
            });
}

/// Finds crossings with the triangulation of a store's points (see PointWindow). Reads windows of
/// the store one after another along the line.
class PointCrossings {
 public:
  /// Uses the max_edge of the options.
  PointCrossings(std::shared_ptr<SampledCloud> sampled, const SamplerOptions& options,
                 std::uint64_t memory_bytes);

  /// As FindCrossings.
  void operator()(const Point2& from, const Point2& to, const VisitCrossing& visit);

 private:
  void collect(const Point2& from, const Point2& to, double begin, double end, bool is_last);

  std::shared_ptr<SampledCloud> sampled_;
  TooLong too_long_;
  PointWindow window_;
  std::vector<SurfaceCrossing> found_;
};

PointCrossings::PointCrossings(std::shared_ptr<SampledCloud> sampled, const SamplerOptions& options,
                               std::uint64_t memory_bytes)
    : sampled_(std::move(sampled)), window_(sampled_->cloud, memory_bytes / 2) {
  if (options.max_edge) too_long_ = longer_than(sampled_->store, *options.max_edge);
}

void PointCrossings::operator()(const Point2& from, const Point2& to, const VisitCrossing& visit) {
  const StoredBox all = flat(sampled_->store.bounds());
  if (from == to) return;
  const auto [first, last] = part_within(all, from, to);
  double latest = -1;
  for (double begin = first; begin <= last;) {
    const WindowTree& tree = sampled_->windows;
    const StoredBox& box = tree.box(tree.window_of(between(from, to, begin)));
    double end = 1;
    for (std::size_t k = 0; k < 2; ++k) {
      const double size = box.max[k] - box.min[k], way = std::abs(to[k] - from[k]);
      if (size > 0 && way > 0) end = std::min(end, begin + kCrossingPiece * size / way);
    }
    // Advance at least this far, so that the loop ends.
    end = std::max(end, begin + 1e-9);
    collect(from, to, begin, std::min(end, last), end >= last);
    for (const SurfaceCrossing& one : found_) {
      if (one.t - latest <= kSameCrossing && latest >= 0) continue;
      visit(one);
      latest = one.t;
    }
    if (end >= last) break;
    begin = end;
  }
}

void PointCrossings::collect(const Point2& from, const Point2& to, double begin, double end,
                             bool is_last) {
  // Includes crossings that rounding may move into this piece.
  const Point2 a = between(from, to, std::max(0.0, begin - 1e-9));
  const Point2 b = between(from, to, std::min(1.0, end + 1e-9));
  window_.load(base::box_of(std::array{a, b}));
  found_.clear();
  const auto& triangulation = window_.triangulation();
  const auto add = [&](const Point2& p, const SurfaceCorner& c, const SurfaceCorner& d,
                       double share) {
    const bool is_surface = !too_long_ || !too_long_(c.place, d.place);
    const double height = is_surface && !sampled_->is_lattice(p)
                              ? c.height + share * (d.height - c.height)
                              : std::numeric_limits<double>::quiet_NaN();
    const double t = along(from, to, p);
    if (t > 0 && t < 1 && t >= begin && (t < end || is_last)) found_.push_back({t, p, height});
  };
  for (const tri::TriangleId triangle : triangulation.all_triangles()) {
    if (!window_.is_certain(triangle)) continue;
    cross_triangle(window_.corners_with_heights(triangle), from, to, add);
  }
  sort_crossings(found_);
}

/// Finds crossings with a bounded surface, in one window after another along the line.
class BoundedCrossings {
 public:
  /// has_gaps: leaves heights to the sampler, which knows missing samples.
  BoundedCrossings(std::shared_ptr<BoundedParts> surface, bool has_gaps)
      : parts_(std::move(surface)), has_gaps_(has_gaps) {}

  /// As FindCrossings.
  void operator()(const Point2& from, const Point2& to, const VisitCrossing& visit) const {
    if (from == to) return;
    struct Met {
      double begin = 0;
      std::uint32_t window = 0;
    };
    const BoundedSurface& surface = parts_->surface();
    std::vector<Met> met;
    for (std::uint32_t window = 0; window < surface.size(); ++window) {
      const auto [begin, end] = part_within(surface.box(window), from, to);
      if (begin <= end) met.push_back({begin, window});
    }
    std::stable_sort(met.begin(), met.end(),
                     [](const Met& a, const Met& b) { return a.begin < b.begin; });
    const StoredBox leg = base::box_of(std::array{from, to});
    std::vector<SurfaceCrossing> found;
    double latest = -1;
    for (std::size_t i = 0; i < met.size(); ++i) {
      const std::shared_ptr<const BoundedPart> part = (*parts_)(met[i].window);
      for (const BoundedPart::Triangle& t : part->triangles()) {
        const SurfaceTriangle corners = part->corners(t);
        const auto& [a, b, c] = corners;
        if (!leg.intersects(base::box_of(std::array{a.place, b.place, c.place}))) continue;
        cross_triangle(
            corners, from, to,
            [&](const Point2& p, const SurfaceCorner& d, const SurfaceCorner& e, double share) {
              const double at = along(from, to, p);
              const double height = has_gaps_ ? NAN : d.height + share * (e.height - d.height);
              if (at > 0 && at < 1) found.push_back({at, p, height});
            });
      }
      sort_crossings(found);
      // Later windows have no crossings before their boxes.
      const double next = i + 1 < met.size() ? met[i + 1].begin - kSameCrossing : 2.0;
      std::size_t done = 0;
      for (; done < found.size() && found[done].t < next; ++done) {
        if (found[done].t - latest <= kSameCrossing && latest >= 0) continue;
        visit(found[done]);
        latest = found[done].t;
      }
      found.erase(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(done));
    }
  }

 private:
  std::shared_ptr<BoundedParts> parts_;
  bool has_gaps_;
};

class ProfileRun {
 public:
  ProfileRun(const stream::Store& store, const ProfileRequest& request,
             const std::function<void(std::span<const ProfilePoint>)>& take, const Context& context)
      : request_(request),
        context_(context),
        take_(take),
        ground_(store),
        distance_(LineDistance::of(store)) {
    for (const Point2& place : request.line) line_.push_back(ground_.turned(place));
    if (const auto surface = sampled_surface(store, request.sampler, context)) {
      say_unknown_height_unit(ground_.ground(), context);
      sampler_ = make_bounded_sampler(store, surface, request.sampler, context);
      if (!request.step) crossings_ = BoundedCrossings(surface, store.schema().grid);
      return;
    }
    const std::shared_ptr<SampledCloud> cloud = sampled_cloud(store, request.sampler, context);
    sampler_ = cloud != nullptr ? make_cloud_sampler(cloud, request.sampler, context)
                                : make_sampler(store, request.sampler, context);
    if (!request.step && cloud != nullptr) {
      const auto points =
          std::make_shared<PointCrossings>(cloud, request.sampler, working_memory(context));
      crossings_ = [points](const Point2& from, const Point2& to, const VisitCrossing& visit) {
        (*points)(from, to, visit);
      };
    }
  }

  ProfileOutcome run() {
    check_rows();
    add(line_.front(), 0);
    for (std::size_t leg = 0; leg + 1 < line_.size(); ++leg) {
      const Point2 &a = line_[leg], &b = line_[leg + 1];
      if (request_.step) {
        walk(a, b);
      } else if (crossings_) {
        cross_triangles(a, b);
      } else {
        cross(a, b);
      }
    }
    // The end of the line, unless a step coincides with it.
    if (request_.step && outcome_.metres > last_) add(line_.back(), outcome_.metres);
    flush();
    return outcome_;
  }

 private:
  /// Throws: UsageError for a profile with too many rows.
  void check_rows() const {
    double rows = 0;
    for (std::size_t leg = 0; leg + 1 < line_.size(); ++leg) {
      const Point2 &a = line_[leg], &b = line_[leg + 1];
      if (request_.step) {
        rows += distance_.between(a, b) / *request_.step;
      } else if (!crossings_) {
        const Point2 from = ground_.stored(a), to = ground_.stored(b);
        rows += 2 * (std::abs(to[0] - from[0]) + std::abs(to[1] - from[1]));
      }
    }
    if (!(rows > kMaxRows)) return;
    throw UsageError(stream::message(
        "{}: the profile would have more than {}",
        request_.step ? stream::message("{step} is too small") : "the line is too long",
        counted(static_cast<std::uint64_t>(kMaxRows), "row")));
  }

  /// Adds a point every `step` metres of the leg.
  void walk(const Point2& a, const Point2& b) {
    const DecimalMultiples multiples(*request_.step);
    // Pieces so short that neither the line's curvature nor the map's changing scale matters.
    const double pieces =
        std::clamp(distance_.pieces(a, b, std::min(1000.0, multiples.step() / 4)), 16.0, 1e9);
    Point2 from = a;
    for (double i = 1; i <= pieces; ++i) {
      context_.check_stop();
      const Point2 to = i == pieces ? b : between(a, b, i / pieces);
      const double length = distance_.between(from, to);
      for (double next = multiples(next_step_); next <= outcome_.metres + length;
           next = multiples(++next_step_)) {
        if (!(length > 0)) break;
        add(between(from, to, (next - outcome_.metres) / length), next);
      }
      outcome_.metres += length;
      from = to;
    }
  }

  /// Adds a point at each crossing with the lattice.
  void cross(const Point2& a, const Point2& b) {
    Point2 last = a;
    for_lattice_crossings(ground_.stored(a), ground_.stored(b),
                          [&](double t, const Point2& stored) {
                            context_.check_stop();
                            const Point2 crossing_place = between(a, b, t);
                            outcome_.metres += distance_.along(last, crossing_place);
                            add(crossing_place, outcome_.metres, stored);
                            last = crossing_place;
                          });
    outcome_.metres += distance_.along(last, b);
    add(b, outcome_.metres);
  }

  /// Adds a point at each crossing with an edge of the triangulation.
  void cross_triangles(const Point2& a, const Point2& b) {
    Point2 last = a;
    crossings_(ground_.stored(a), ground_.stored(b), [&](const SurfaceCrossing& crossing) {
      const Point2 crossing_place = between(a, b, crossing.t);
      outcome_.metres += distance_.along(last, crossing_place);
      add(crossing_place, outcome_.metres, crossing.place, crossing.height);
      last = crossing_place;
    });
    outcome_.metres += distance_.along(last, b);
    add(b, outcome_.metres);
  }

  void add(const Point2& place, double metres) { add(place, metres, ground_.stored(place)); }
  /// known: the height of the linear surface there if it was computed, otherwise NaN.
  void add(const Point2& place, double metres, const Point2& stored, double known = NAN) {
    places_.push_back(place);
    metres_.push_back(metres);
    stored_.push_back(stored);
    known_.push_back(known);
    last_ = metres;
    if (places_.size() >= kRowsAtOnce) flush();
  }

  void flush() {
    context_.check_stop();
    surface_.assign(stored_.size(), {});
    const tri::Interpolation method = request_.sampler.method;
    if (method == tri::Interpolation::linear) {
      for (std::size_t i = 0; i < stored_.size(); ++i) {
        if (!std::isnan(known_[i])) stored_[i] = {NAN, NAN};  // already known
      }
    }
    sampler_->sample(stored_, surface_);
    for (std::size_t i = 0; i < stored_.size(); ++i) {
      // On an edge, where rounding may lead outside.
      const bool missed = std::isnan(surface_[i].height);
      if (missed && method != tri::Interpolation::nearest) surface_[i].height = known_[i];
    }
    points_.resize(places_.size());
    for (std::size_t i = 0; i < places_.size(); ++i) {
      points_[i] = {.metres = metres_[i], .place = places_[i], .height = surface_[i].height};
      outcome_.answered += std::isnan(surface_[i].height) ? 0 : 1;
    }
    outcome_.points += places_.size();
    take_(points_);
    places_.clear();
    metres_.clear();
    stored_.clear();
    known_.clear();
  }

  const ProfileRequest& request_;
  const Context& context_;
  const std::function<void(std::span<const ProfilePoint>)>& take_;
  GroundSlope ground_;
  LineDistance distance_;
  std::vector<Point2> line_;
  std::unique_ptr<HeightSampler> sampler_;
  ProfileOutcome outcome_;
  double next_step_ = 1, last_ = 0;
  std::vector<Point2> places_, stored_;
  std::vector<double> metres_, known_;
  FindCrossings crossings_;  ///< empty: rows are `step` apart, or at crossings with the lattice
  std::vector<SurfacePoint> surface_;
  std::vector<ProfilePoint> points_;
};

double largest_height(const stream::Store& store) {
  const stream::Channel& z = store.schema().coordinates[2];
  const auto height = [&](double raw) { return std::abs(raw * z.scale + z.offset); };
  return std::max(height(store.bounds().min[2]), height(store.bounds().max[2]));
}

}  // namespace

ProfileOutcome profile(const stream::Store& store, const ProfileRequest& original,
                       const std::function<void(std::span<const ProfilePoint>)>& take,
                       const Context& context) {
  need_terrain(store, "a profile");
  ProfileRequest request = original;
  const double max_latitude =
      request.to_line ? request.to_line->to().most_latitude() : most_latitude(store.schema().crs);
  check_latitudes(request.line, max_latitude, store.path().string());
  if (request.to_line) request.to_line->reverse(request.line);
  if (request.line.size() < 2) throw UsageError("a profile needs a line of two places or more");
  for (const Point2& place : request.line) {
    constexpr double kFarthest = 0x1p40;  // columns and rows this large still differ by 1
    for (const double c : stream::stored_place(store.schema(), place)) {
      if (!(std::abs(c) < kFarthest)) {
        throw UsageError("a place of the line is not finite or too far away");
      }
    }
  }
  return ProfileRun(store.with_stop(context.stop), request, take, context).run();
}

ProfileOutcome write_profile(const stream::Store& store, const ProfileRequest& request,
                             const std::function<void(std::string_view)>& write,
                             const Context& context) {
  const FixedText heights = FixedText::for_numbers_up_to(largest_height(store)), metres(4);
  std::string text = std::string(kProfileHead) + '\n';
  const auto add_rows = [&](std::span<const ProfilePoint> points) {
    for (const ProfilePoint& point : points) {
      metres.append(text, point.metres);
      text += ',';
      text += number_text(point.place[0]);
      text += ',';
      text += number_text(point.place[1]);
      text += ',';
      heights.append(text, point.height);
      text += '\n';
    }
    write(text);
    text.clear();
  };
  return profile(store, request, add_rows, context);
}

}  // namespace terrace::terrain
