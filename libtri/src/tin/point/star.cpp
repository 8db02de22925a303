// SPDX-License-Identifier: Apache-2.0
#include "star.hpp"

#include <bit>
#include <cmath>
#include <limits>

namespace terrace::tri::tin::points {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

void StarSamples::gather(const Mesh& mesh, const Star& star, const Vertex& centre,
                         std::uint32_t extra) {
  const Pool<Sample>& samples = *mesh.samples;
  ring_.clear();
  x_.clear();
  y_.clear();
  z_.clear();
  index_.clear();
  const auto add = [&](std::uint32_t i) {
    index_.push_back(i);
    x_.push_back(samples[i].x - centre.x);
    y_.push_back(samples[i].y - centre.y);
    z_.push_back(samples[i].z - centre.z);
  };
  for (std::size_t k = 0; k < star.size(); ++k) {
    const Vertex& corner = mesh.vertices[star.ring(k)];
    ring_.push_back({corner.x - centre.x, corner.y - centre.y, corner.z - centre.z, kNone});
    for (std::uint32_t i = mesh.heads[star.triangle(k)]; i != kNone; i = samples[i].next) add(i);
  }
  if (extra != kNone) add(extra);
  for (std::size_t i = 0; i < star.size(); ++i)
    for (std::size_t j = i + 1; j < star.size(); ++j) sides_[i][j].known = false;
}

double StarSamples::cross_at(std::size_t i, std::size_t j, std::size_t sample) const {
  const Vertex& a = ring_[i];
  const Vertex& b = ring_[j];
  return (b.x - a.x) * (y_[sample] - a.y) - (b.y - a.y) * (x_[sample] - a.x);
}

const StarSamples::Sides& StarSamples::sides(std::size_t i, std::size_t j) {
  Sides& result = sides_[i][j];
  if (result.known) return result;
  result.known = true;
  const std::size_t count = index_.size();
  const std::size_t words = (count + 63) / 64;
  result.left.assign(words, 0);
  result.right.assign(words, 0);
  const double ax = ring_[i].x;
  const double ay = ring_[i].y;
  const double dx = ring_[j].x - ax;
  const double dy = ring_[j].y - ay;
  for (std::size_t w = 0; w < words; ++w) {
    const std::size_t end = std::min(count, (w + 1) * 64);
    std::uint64_t left = 0;
    std::uint64_t right = 0;
    for (std::size_t s = w * 64; s < end; ++s) {
      const double cross = dx * (y_[s] - ay) - dy * (x_[s] - ax);
      left |= static_cast<std::uint64_t>(cross >= 0) << (s % 64);
      right |= static_cast<std::uint64_t>(cross <= 0) << (s % 64);
    }
    result.left[w] = left;
    result.right[w] = right;
  }
  return result;
}

double StarSamples::worst(std::size_t i, std::size_t m, std::size_t j, double limit) {
  const Vertex& a = ring_[i];
  const Plane plane = plane_of(a, ring_[m], ring_[j]);
  if (!plane.sound) return kNever;
  const Words& first = sides(i, m).left;
  const Words& second = sides(m, j).left;
  const Words& chord = sides(i, j).right;
  double largest = 0;
  for (std::size_t w = 0; w < first.size(); ++w) {
    for (std::uint64_t bits = first[w] & second[w] & chord[w]; bits != 0; bits &= bits - 1) {
      const std::size_t s = w * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      const double height = a.z + (plane.gx * (x_[s] - a.x) + plane.gy * (y_[s] - a.y));
      const double error = std::abs(height - z_[s]);
      if (error > largest) {
        if (error > limit) return kNever;
        largest = error;
      }
    }
  }
  return largest;
}

bool StarSamples::wide(std::size_t i, std::size_t m, std::size_t j, double tangent) const {
  const std::array<std::size_t, 3> corner{i, m, j};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vertex& p = ring_[corner[k]];
    const Vertex& a = ring_[corner[(k + 1) % 3]];
    const Vertex& b = ring_[corner[(k + 2) % 3]];
    const double cross = (a.x - p.x) * (b.y - p.y) - (a.y - p.y) * (b.x - p.x);
    const double dot = (a.x - p.x) * (b.x - p.x) + (a.y - p.y) * (b.y - p.y);
    if (cross < tangent * dot) return false;
  }
  return true;
}

void StarSamples::list(Mesh& mesh, const Star& star, const PolygonFill& fill) {
  const std::size_t count = index_.size();
  rest_.assign((count + 63) / 64, ~std::uint64_t{0});
  if (count % 64 != 0) rest_.back() >>= 64 - count % 64;
  for (std::size_t k = 0; k < star.size(); ++k) mesh.heads[star.triangle(k)] = kNone;
  // Slots are reused in the order in which triangles are visited.
  std::size_t k = 0;
  star.all_of(fill, [&](std::size_t i, std::size_t m, std::size_t j) {
    const Words& first = sides(i, m).left;
    const Words& second = sides(m, j).left;
    const Words& chord = sides(i, j).right;
    std::uint32_t& head = mesh.heads[star.triangle(k++)];
    for (std::size_t w = 0; w < rest_.size(); ++w) {
      const std::uint64_t inside = rest_[w] & first[w] & second[w] & chord[w];
      rest_[w] &= ~inside;
      for (std::uint64_t bits = inside; bits != 0; bits &= bits - 1) {
        const std::uint32_t s = index_[w * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
        (*mesh.samples)[s].next = head;
        head = s;
      }
    }
    return true;
  });
  for (std::size_t w = 0; w < rest_.size(); ++w)
    for (std::uint64_t bits = rest_[w]; bits != 0; bits &= bits - 1)
      list_rest(mesh, star, fill, w * 64 + static_cast<std::size_t>(std::countr_zero(bits)));
}

// Samples that rounding puts into no triangle go to the triangle they are least outside of.
void StarSamples::list_rest(Mesh& mesh, const Star& star, const PolygonFill& fill,
                            std::size_t sample) const {
  double best = -kNever;
  std::uint32_t slot = star.triangle(0);
  std::size_t k = 0;
  star.all_of(fill, [&](std::size_t i, std::size_t m, std::size_t j) {
    const double least =
        std::min(std::min(cross_at(i, m, sample), cross_at(m, j, sample)), cross_at(j, i, sample));
    if (least > best) {
      best = least;
      slot = star.triangle(k);
    }
    ++k;
    return true;
  });
  (*mesh.samples)[index_[sample]].next = mesh.heads[slot];
  mesh.heads[slot] = index_[sample];
}

}  // namespace terrace::tri::tin::points
