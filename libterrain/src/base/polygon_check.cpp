// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/tri/predicates.hpp>

#include "base/region_shape.hpp"
#include "base/units.hpp"

namespace terrace::terrain {
namespace {

constexpr const char* kCrossing = "Self-intersection";

/// Visits the corners from left to right and, at equal x, from below. Keeps the edges that cross
/// the sweep line in order from below. No two of them cross before the sweep line, because a
/// crossing is found when its edges become neighbours. So their order never changes.
///
/// Rings may touch each other at single places. The polygon is then valid if no ring crosses
/// another there and the touching rings do not form a cycle, which would cut the interior in two.
class PolygonSweep {
 public:
  PolygonSweep(const Polygon& polygon, const std::stop_token& stop) : stop_(stop) {
    for (const std::vector<Point2>& ring : polygon) add_ring(ring);
    sets_.resize(rings_.size());
    std::iota(sets_.begin(), sets_.end(), 0U);
  }

  std::optional<std::string> run() {
    if (fault_) return fault_;
    std::vector<std::uint32_t> events(corners_.size());
    std::iota(events.begin(), events.end(), 0U);
    std::size_t compared = 0;
    std::sort(events.begin(), events.end(), [&](std::uint32_t a, std::uint32_t b) {
      check_stop(++compared);
      return corners_[a] < corners_[b];
    });
    for (std::size_t begin = 0, end = 0; begin < events.size() && !fault_; begin = end) {
      const Point2& place = corners_[events[begin]];
      while (end < events.size() && corners_[events[end]] == place) check_stop(++end);
      visit(place, std::span(events).subspan(begin, end - begin));
    }
    return fault_;
  }

 private:
  /// A ring's corners are consecutive.
  struct Ring {
    std::uint32_t begin, end;
    std::uint32_t first = 0;        ///< the corner where the sweep meets it
    bool counter_clockwise = true;  ///< known once the sweep has met `first`
  };
  /// Orders edges from below. An edge has the number of the corner at which it begins.
  struct FromBelow {
    using is_transparent = void;
    const PolygonSweep* sweep;
    bool operator()(std::uint32_t a, std::uint32_t b) const { return sweep->is_below(a, b); }
    bool operator()(std::uint32_t edge, const Point2& place) const {
      return sweep->side(edge, place) > 0;
    }
    bool operator()(const Point2& place, std::uint32_t edge) const {
      return sweep->side(edge, place) < 0;
    }
  };
  using Status = std::set<std::uint32_t, FromBelow>;
  /// A direction in which an edge leaves a place.
  struct Direction {
    Point2 to;
    std::uint32_t pass;  ///< which passage of a ring through the place it belongs to
  };

  void check_stop(std::size_t step) const {
    constexpr std::size_t kBetweenChecks = 4096;
    if (step % kBetweenChecks == 0 && stop_.stop_requested()) throw stream::Stopped();
  }

  void add_ring(const std::vector<Point2>& places) {
    Ring ring{static_cast<std::uint32_t>(corners_.size()), 0};
    for (const Point2& p : places) {
      // A corner may be repeated.
      if (corners_.size() > ring.begin && corners_.back() == p) continue;
      corners_.push_back(p);
    }
    while (corners_.size() > ring.begin + 1 && corners_.back() == corners_[ring.begin]) {
      corners_.pop_back();
    }
    ring.end = static_cast<std::uint32_t>(corners_.size());
    if (ring.end - ring.begin < 3) {
      fail("Too few different corners", places.front());
      return;
    }
    const auto begin = corners_.begin() + ring.begin;
    ring.first =
        ring.begin + static_cast<std::uint32_t>(std::min_element(begin, corners_.end()) - begin);
    ring_of_.resize(corners_.size(), static_cast<std::uint32_t>(rings_.size()));
    rings_.push_back(ring);
  }

  void fail(const char* what, const Point2& place) {
    if (!fault_) {
      fault_ = std::string(what) + " at " + number_text(place[0]) + ", " + number_text(place[1]);
    }
  }

  [[nodiscard]] std::uint32_t next(std::uint32_t corner) const {
    const Ring& ring = rings_[ring_of_[corner]];
    return corner + 1 == ring.end ? ring.begin : corner + 1;
  }
  [[nodiscard]] std::uint32_t before(std::uint32_t corner) const {
    const Ring& ring = rings_[ring_of_[corner]];
    return corner == ring.begin ? ring.end - 1 : corner - 1;
  }
  [[nodiscard]] bool leads_on(std::uint32_t edge) const {
    return corners_[edge] < corners_[next(edge)];
  }
  [[nodiscard]] const Point2& left(std::uint32_t edge) const {
    return corners_[leads_on(edge) ? edge : next(edge)];
  }
  [[nodiscard]] const Point2& right(std::uint32_t edge) const {
    return corners_[leads_on(edge) ? next(edge) : edge];
  }
  /// Returns 1 if the place is above the edge's line, 0 if on it, -1 if below.
  [[nodiscard]] int side(std::uint32_t edge, const Point2& place) const {
    return tri::orientation(left(edge), right(edge), place);
  }
  /// Requires edges that do not cross each other and that both cross some sweep line.
  [[nodiscard]] bool is_below(std::uint32_t a, std::uint32_t b) const {
    if (a == b) return false;
    if (left(b) < left(a)) return !is_below(b, a);
    const int begins = side(a, left(b));
    return begins != 0 ? begins > 0 : side(a, right(b)) > 0;
  }
  /// Whether the interior of the ring is above the edge.
  [[nodiscard]] bool inside_above(std::uint32_t edge) const {
    return leads_on(edge) == rings_[ring_of_[edge]].counter_clockwise;
  }

  void visit(const Point2& place, std::span<const std::uint32_t> corners) {
    const auto [low, high] = status_.equal_range(place);
    std::uint32_t passing = kNone;
    for (auto at = low; at != high; ++at) {
      if (right(*at) == place) continue;
      if (passing != kNone) return fail(kCrossing, place);
      passing = *at;
    }
    if (!fit_together(place, corners, passing)) return;
    for (auto at = low; at != high;) at = *at == passing ? std::next(at) : status_.erase(at);
    std::size_t inside = passing == kNone ? 0 : 1;
    for (const std::uint32_t corner : corners) {
      for (const std::uint32_t edge : {before(corner), corner}) {
        if (left(edge) != place) continue;
        status_.insert(high, edge);
        ++inside;
      }
    }
    // Checks the edges that begin at or pass through the place, and one neighbour on each side.
    auto at = high;
    for (std::size_t i = 0; i < inside && at != status_.begin(); ++i) --at;
    if (at != status_.begin()) --at;
    for (auto above = at; at != status_.end() && at != high; at = above) {
      if (++above == status_.end()) break;
      if (crosses(*at, *above)) return fail(kCrossing, crossing_of(*at, *above));
    }
    for (const std::uint32_t corner : corners) find_turn(corner);
    for (const std::uint32_t corner : corners) place_hole(corner);
  }

  /// Whether the passages of rings through a place neither cross nor overlap. Records a fault if
  /// they do.
  bool fit_together(const Point2& place, std::span<const std::uint32_t> corners,
                    std::uint32_t passing) {
    directions_.clear();
    touching_.clear();
    for (const std::uint32_t corner : corners) {
      const auto pass = static_cast<std::uint32_t>(touching_.size());
      directions_.push_back({corners_[before(corner)], pass});
      directions_.push_back({corners_[next(corner)], pass});
      touching_.push_back(ring_of_[corner]);
    }
    if (passing != kNone) {
      const auto pass = static_cast<std::uint32_t>(touching_.size());
      directions_.push_back({left(passing), pass});
      directions_.push_back({right(passing), pass});
      touching_.push_back(ring_of_[passing]);
    }
    const auto ahead = [&](const Direction& d) { return place < d.to; };
    std::sort(directions_.begin(), directions_.end(), [&](const Direction& a, const Direction& b) {
      if (ahead(a) != ahead(b)) return ahead(a);
      return tri::orientation(place, a.to, b.to) > 0;
    });
    for (std::size_t i = 1; i < directions_.size(); ++i) {
      const Direction &a = directions_[i - 1], &b = directions_[i];
      if (ahead(a) == ahead(b) && tri::orientation(place, a.to, b.to) == 0) {
        fail(kCrossing, place);
        return false;
      }
    }
    if (touching_.size() == 1) return true;
    // Passages that do not cross are nested like brackets.
    std::vector<std::uint32_t> open;
    for (const Direction& d : directions_) {
      if (!open.empty() && open.back() == d.pass) {
        open.pop_back();
      } else {
        open.push_back(d.pass);
      }
    }
    if (!open.empty()) {
      fail(kCrossing, place);
      return false;
    }
    return join(place);
  }

  /// Connects the rings that touch at a place. Records a fault and returns false if a ring touches
  /// itself or if they are already connected.
  bool join(const Point2& place) {
    std::sort(touching_.begin(), touching_.end());
    if (std::adjacent_find(touching_.begin(), touching_.end()) != touching_.end()) {
      fail("Ring Self-intersection", place);
      return false;
    }
    for (std::size_t i = 1; i < touching_.size(); ++i) {
      const std::uint32_t a = set_of(touching_[0]), b = set_of(touching_[i]);
      if (a == b) {
        fail("Interior is disconnected", place);
        return false;
      }
      sets_[b] = a;
    }
    return true;
  }
  std::uint32_t set_of(std::uint32_t ring) {
    while (sets_[ring] != ring) ring = sets_[ring] = sets_[sets_[ring]];
    return ring;
  }

  /// Whether the edges cross at a place inside both.
  [[nodiscard]] bool crosses(std::uint32_t a, std::uint32_t b) const {
    return side(a, left(b)) * side(a, right(b)) < 0 && side(b, left(a)) * side(b, right(a)) < 0;
  }
  /// Returns the place where the edges cross, rounded.
  [[nodiscard]] Point2 crossing_of(std::uint32_t a, std::uint32_t b) const {
    const Point2 &p = left(a), &q = left(b);
    const Point2 u{right(a)[0] - p[0], right(a)[1] - p[1]},
        v{right(b)[0] - q[0], right(b)[1] - q[1]};
    const double share =
        ((q[0] - p[0]) * v[1] - (q[1] - p[1]) * v[0]) / (u[0] * v[1] - u[1] * v[0]);
    return {p[0] + share * u[0], p[1] + share * u[1]};
  }

  /// Determines the orientation of a ring at its first corner.
  void find_turn(std::uint32_t corner) {
    Ring& ring = rings_[ring_of_[corner]];
    if (ring.first != corner) return;
    ring.counter_clockwise =
        tri::orientation(corners_[before(corner)], corners_[corner], corners_[next(corner)]) > 0;
  }

  /// Records a fault if the place below a hole's first corner is not in the polygon's interior.
  void place_hole(std::uint32_t corner) {
    const Ring& ring = rings_[ring_of_[corner]];
    if (ring.first != corner || ring_of_[corner] == 0) return;
    const auto lower = status_.find(ring.counter_clockwise ? corner : before(corner));
    if (lower == status_.begin()) return fail("Hole lies outside shell", corners_[corner]);
    const std::uint32_t below = *std::prev(lower);
    const bool of_shell = ring_of_[below] == 0;
    if (of_shell == inside_above(below)) return;
    fail(of_shell ? "Hole lies outside shell" : "Nested holes", corners_[corner]);
  }

  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  const std::stop_token& stop_;
  std::vector<Point2> corners_;
  std::vector<std::uint32_t> ring_of_;
  std::vector<Ring> rings_;
  std::vector<std::uint32_t> sets_;  ///< union-find of the rings that touch
  Status status_{FromBelow{this}};
  std::vector<Direction> directions_;
  std::vector<std::uint32_t> touching_;  ///< the rings through a place
  std::optional<std::string> fault_;
};

}  // namespace

std::optional<std::string> fault_of(const Polygon& polygon, const std::stop_token& stop) {
  return PolygonSweep(polygon, stop).run();
}

}  // namespace terrace::terrain
