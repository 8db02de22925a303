// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/surface_smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/parallel.hpp>
#include <terrace/base/portable_math.hpp>
#include <terrace/base/stop_check.hpp>

#include "incidence.hpp"

namespace terrace::tri {
namespace {

using shape::Vector3;

/// Taubin's factors: 1 / kForward + 1 / kBackward is the pass band.
constexpr double kPassBand = 0.05, kForward = 0.5,
                 kBackward = -kForward / (1 - kPassBand * kForward);
/// Normals that differ by this much, as vectors, have exp(-1/2) of the influence of equal ones.
constexpr double kNormalSpread = 0.35;
constexpr unsigned kVertexSteps = 20;

/// Returns e^-x for 0 <= x <= 17, with a relative error below 1e-11: the 16th power of a series.
/// Several times as fast as base::exp(), which takes most of the time otherwise.
double decay(double x) {
  static constexpr std::array<double, 16> kInverseFactorials = [] {
    std::array<double, 16> out{1.0};
    for (std::size_t n = 1; n < out.size(); ++n) out[n] = out[n - 1] / static_cast<double>(n);
    return out;
  }();
  double power = base::polynomial(kInverseFactorials, x / -16);
  for (int i = 0; i < 4; ++i) power *= power;
  return power;
}
// The largest difference of two unit vectors is 2.
static_assert(2.0 / (kNormalSpread * kNormalSpread) < 17.0);

/// The smoothing of one surface, in local coordinates (shape::SurfaceFrame).
class SurfaceSmoother {
 public:
  SurfaceSmoother(const Surface& surface, const SurfaceSmoothingOptions& options)
      : surface_(surface),
        options_(options),
        frame_(surface.points),
        incidence_(surface),
        sample_(surface.points.size()),
        held_(surface.points.size()) {
    for_blocks(sample_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) sample_[v] = frame_.local(surface_.points[v]);
    });
    limit_ = frame_.to_local(options.limit.value_or(frame_.from_local(spacing())));
    place_ = next_ = sample_;
  }

  void run() {
    find_rings();
    if (options_.method == SurfaceSmoothing::taubin) {
      for (unsigned i = 0; i < options_.iterations; ++i) {
        step_to_means(kForward);
        step_to_means(kBackward);
      }
    } else {
      filter_normals();
      for (unsigned i = 0; i < kVertexSteps && options_.iterations > 0; ++i) step_to_normals();
    }
  }

  [[nodiscard]] SmoothedPoints result() const {
    SmoothedPoints out;
    out.points = surface_.points;
    std::vector<double> moves(place_.size());
    for_blocks(place_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) moves[v] = move_point(v, out.points[v]);
    });
    out.moves.limit = options_.limit.value_or(frame_.from_local(limit_));
    double sum = 0.0;
    for (const double move : moves) {
      sum += move;
      out.moves.largest = std::max(out.moves.largest, move);
    }
    if (!moves.empty()) out.moves.mean = frame_.from_local(sum / static_cast<double>(moves.size()));
    out.moves.largest = frame_.from_local(out.moves.largest);
    out.moves.limited = static_cast<std::size_t>(std::count(held_.begin(), held_.end(), 1));
    return out;
  }

 private:
  template <class Work>
  void for_blocks(std::size_t count, const Work& work) const {
    base::parallel_blocks(count, shape::kSurfaceBlock, options_.threads,
                          [&](std::size_t begin, std::size_t end) {
                            if (options_.check_stop) options_.check_stop();
                            work(begin, end);
                          });
  }

  /// The median length of the faces' sides, a side of two faces counted twice.
  [[nodiscard]] double spacing() const {
    std::vector<double> squares(3 * surface_.faces.size(), -1.0);
    for_blocks(surface_.faces.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        if (!shape::has_three_corners(surface_.faces[f])) continue;
        for (std::size_t i = 0; i < 3; ++i) {
          const Vector3 side =
              shape::minus(sample_[surface_.faces[f][i]], sample_[surface_.faces[f][(i + 1) % 3]]);
          squares[3 * f + i] = shape::dot(side, side);
        }
      }
    });
    std::erase_if(squares, [](double square) { return square < 0.0; });
    if (squares.empty()) return 0.0;
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    return std::sqrt(*middle);
  }

  /// A neighbour of a point: its number, its place in the order of the faces, and the number of
  /// faces with both.
  struct Neighbour {
    std::uint32_t point, first, faces;
  };

  /// Sets `out` to the neighbours of a point in the order of the faces.
  void find_neighbours(std::size_t v, std::vector<Neighbour>& out) const {
    out.clear();
    for (const std::uint32_t f : incidence_.faces_at(v)) {
      for (const std::uint32_t corner : surface_.faces[f]) {
        if (corner != v) out.push_back({corner, static_cast<std::uint32_t>(out.size()), 1});
      }
    }
    std::sort(out.begin(), out.end(), [](const Neighbour& a, const Neighbour& b) {
      return a.point != b.point ? a.point < b.point : a.first < b.first;
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (kept > 0 && out[kept - 1].point == out[i].point) {
        ++out[kept - 1].faces;
      } else {
        out[kept++] = out[i];
      }
    }
    out.resize(kept);
    std::sort(out.begin(), out.end(),
              [](const Neighbour& a, const Neighbour& b) { return a.first < b.first; });
  }

  /// Sets the neighbours of the points that move. The others have none.
  void find_rings() {
    const std::size_t count = sample_.size();
    std::vector<std::vector<std::uint32_t>> parts((count + shape::kSurfaceBlock - 1) /
                                                  shape::kSurfaceBlock);
    ring_begin_.assign(count + 1, 0);
    for_blocks(count, [&](std::size_t begin, std::size_t end) {
      std::vector<Neighbour> neighbours;
      std::vector<std::uint32_t>& part = parts[begin / shape::kSurfaceBlock];
      for (std::size_t v = begin; v < end; ++v) {
        find_neighbours(v, neighbours);
        const bool border = std::any_of(neighbours.begin(), neighbours.end(),
                                        [](const Neighbour& n) { return n.faces == 1; });
        if (border) neighbours.clear();
        for (const Neighbour& n : neighbours) part.push_back(n.point);
        ring_begin_[v + 1] = neighbours.size();
      }
    });
    for (std::size_t v = 0; v < count; ++v) ring_begin_[v + 1] += ring_begin_[v];
    ring_.reserve(ring_begin_.back());
    for (const auto& part : parts) ring_.insert(ring_.end(), part.begin(), part.end());
  }

  /// Sets the next place of a point that may move to place + step, or nearer to the sample if that
  /// is beyond the limit.
  void move_to(std::size_t v, const Vector3& step) {
    Vector3 by{};
    for (std::size_t k = 0; k < 3; ++k) by[k] = place_[v][k] + step[k] - sample_[v][k];
    const double length = shape::length(by);
    held_[v] = length > limit_ ? 1 : 0;
    const double factor = held_[v] != 0 ? limit_ / length : 1.0;
    for (std::size_t k = 0; k < 3; ++k) next_[v][k] = sample_[v][k] + by[k] * factor;
  }

  /// Moves every point by `factor` of the way to the mean of its neighbours.
  void step_to_means(double factor) {
    for_blocks(place_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const std::size_t first = ring_begin_[v], last = ring_begin_[v + 1];
        if (first == last) continue;
        Vector3 sum{};
        for (std::size_t i = first; i < last; ++i) {
          const Vector3& other = place_[ring_[i]];
          for (std::size_t k = 0; k < 3; ++k) sum[k] += other[k] - place_[v][k];
        }
        for (double& x : sum) x *= factor / static_cast<double>(last - first);
        move_to(v, sum);
      }
    });
    place_.swap(next_);
  }

  /// Calls work(g) for each face that shares a corner with face f, except f, in an order that
  /// depends on the faces alone.
  template <class Work>
  void for_each_face_around(std::uint32_t f, const Work& work) const {
    if (!shape::has_three_corners(surface_.faces[f])) return;
    const auto& [a, b, c] = surface_.faces[f];
    const auto has = [](const auto& face, std::uint32_t v) {
      return face[0] == v || face[1] == v || face[2] == v;
    };
    for (const std::uint32_t g : incidence_.faces_at(a)) {
      if (g != f) work(g);
    }
    for (const std::uint32_t g : incidence_.faces_at(b)) {
      if (g != f && !has(surface_.faces[g], a)) work(g);
    }
    for (const std::uint32_t g : incidence_.faces_at(c)) {
      if (g != f && !has(surface_.faces[g], a) && !has(surface_.faces[g], b)) work(g);
    }
  }

  [[nodiscard]] Vector3 middle_of(std::size_t f) const {
    const auto& [a, b, c] = surface_.faces[f];
    Vector3 out{};
    for (std::size_t k = 0; k < 3; ++k) out[k] = (place_[a][k] + place_[b][k] + place_[c][k]) / 3;
    return out;
  }

  /// The faces around each face, with the share of their weight that does not change: area times a
  /// Gaussian of the distance, whose width is the mean distance between such faces.
  struct FacesAround {
    std::vector<std::size_t> begin{};  ///< start of face f in the others; one extra at the end
    std::vector<std::uint32_t> face{};
    std::vector<double> weight{};
  };
  [[nodiscard]] FacesAround faces_around(const std::vector<double>& area) const {
    const std::size_t count = surface_.faces.size();
    FacesAround out;
    out.begin.assign(count + 1, 0);
    for_blocks(count, [&](std::size_t f, std::size_t end) {
      for (; f < end; ++f) {
        for_each_face_around(static_cast<std::uint32_t>(f),
                             [&](std::uint32_t) { ++out.begin[f + 1]; });
      }
    });
    for (std::size_t f = 0; f < count; ++f) out.begin[f + 1] += out.begin[f];
    out.face.resize(out.begin.back());
    out.weight.resize(out.begin.back());
    for_blocks(count, [&](std::size_t f, std::size_t end) {
      for (std::size_t next = out.begin[f]; f < end; ++f) {
        for_each_face_around(static_cast<std::uint32_t>(f), [&](std::uint32_t g) {
          out.face[next] = g;
          out.weight[next++] = shape::length(shape::minus(middle_of(g), middle_of(f)));
        });
      }
    });
    double sum = 0.0;
    for (const double distance : out.weight) sum += distance;
    // Without distances, all faces are at one place and have no normals.
    const double mean = sum > 0.0 ? sum / static_cast<double>(out.weight.size()) : 1.0;
    for_blocks(out.weight.size(), [&](std::size_t i, std::size_t end) {
      for (; i < end; ++i) {
        const double part = out.weight[i] / mean;
        out.weight[i] = area[out.face[i]] * base::exp(-0.5 * part * part);
      }
    });
    return out;
  }

  /// Sets normal_ to the filtered normals of the faces, zero for those without a direction.
  void filter_normals() {
    const std::size_t count = surface_.faces.size();
    std::vector<double> area(count);
    normal_.resize(count);
    for_blocks(count, [&](std::size_t f, std::size_t end) {
      for (; f < end; ++f) {
        const auto& [a, b, c] = surface_.faces[f];
        const shape::FaceNormal normal = shape::face_normal(place_[a], place_[b], place_[c]);
        normal_[f] = normal.unit;
        area[f] = normal.area2;
      }
    });
    const FacesAround around = faces_around(area);
    constexpr double kByNormal = 0.5 / (kNormalSpread * kNormalSpread);
    std::vector<Vector3> next(count);
    for (unsigned i = 0; i < options_.iterations; ++i) {
      for_blocks(count, [&](std::size_t f, std::size_t end) {
        for (; f < end; ++f) {
          const Vector3& own = normal_[f];
          Vector3 sum{};
          for (std::size_t k = 0; k < 3; ++k) sum[k] = area[f] * own[k];
          for (std::size_t n = around.begin[f]; n < around.begin[f + 1]; ++n) {
            const Vector3& other = normal_[around.face[n]];
            const Vector3 turn = shape::minus(other, own);
            const double weight = around.weight[n] * decay(kByNormal * shape::dot(turn, turn));
            for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * other[k];
          }
          const double length = shape::length(sum);
          const bool known = length > std::numeric_limits<double>::min();
          for (std::size_t k = 0; k < 3; ++k) next[f][k] = known ? sum[k] / length : own[k];
        }
      });
      normal_.swap(next);
    }
  }

  /// Moves every point towards the planes through the middles of its faces with their filtered
  /// normals: by the mean of the vectors to these planes (X. Sun, P. Rosin, R. Martin, F. Langbein,
  /// doi:10.1109/TVCG.2007.1065).
  void step_to_normals() {
    for_blocks(place_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        if (ring_begin_[v] == ring_begin_[v + 1]) continue;
        Vector3 sum{};
        for (const std::uint32_t f : incidence_.faces_at(v)) {
          const Vector3& n = normal_[f];
          const double height = shape::dot(n, shape::minus(middle_of(f), place_[v]));
          for (std::size_t k = 0; k < 3; ++k) sum[k] += height * n[k];
        }
        for (double& x : sum) x /= static_cast<double>(incidence_.faces_at(v).size());
        move_to(v, sum);
      }
    });
    place_.swap(next_);
  }

  /// Moves a point of the surface to its place, rounded towards where it was so that it stays
  /// within the limit, and returns the distance in local units.
  double move_point(std::size_t v, Point3& point) const {
    Vector3 by = shape::minus(place_[v], sample_[v]);
    // A little less than the limit, so that no way of computing the distance exceeds it.
    const double length = shape::length(by), most = limit_ * (1.0 - 0x1p-50);
    if (length > most) {
      for (double& x : by) x *= most / length;
    }
    const Point3 from = point;
    Vector3 moved{};
    for (std::size_t k = 0; k < 3; ++k) {
      point[k] = from[k] + frame_.from_local(by[k]);
      if (std::abs(frame_.to_local(point[k] - from[k])) > std::abs(by[k])) {
        point[k] = std::nextafter(point[k], from[k]);
      }
      moved[k] = frame_.to_local(point[k] - from[k]);
    }
    return shape::length(moved);
  }

  const Surface& surface_;
  const SurfaceSmoothingOptions& options_;
  shape::SurfaceFrame frame_;
  shape::Incidence incidence_;
  std::vector<Vector3> sample_, place_, next_;
  std::vector<std::uint8_t> held_;  ///< whether the limit held the point back in the last step
  double limit_ = 0.0;
  std::vector<std::size_t> ring_begin_;  ///< start of point v in ring_; one extra at the end
  std::vector<std::uint32_t> ring_;
  std::vector<Vector3> normal_;
};

}  // namespace

SmoothedPoints smooth(const Surface& surface, const SurfaceSmoothingOptions& options) {
  if (options.limit && !(*options.limit >= 0.0)) {
    throw std::invalid_argument("smoothing: the limit " + std::to_string(*options.limit) +
                                " is negative or not a number; give a distance");
  }
  shape::check_corners(surface);
  SurfaceSmoother smoother(surface, options);
  smoother.run();
  return smoother.result();
}

}  // namespace terrace::tri
