// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/canvas.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/base/filled.hpp>
#include <terrace/base/portable_math.hpp>

#include "base/vector.hpp"
#include "cli/interrupt.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// A colour unlike both snow and shadow.
constexpr std::array<float, 3> kBackground{0.90F, 0.92F, 0.94F};

}  // namespace

Canvas::Canvas(std::uint32_t width, std::uint32_t height)
    : width_(width * kOversampling),
      height_(height * kOversampling),
      colours_(base::filled(std::size_t{width_} * height_, kBackground, check_interrupt)),
      depths_(base::filled(std::size_t{width_} * height_, -std::numeric_limits<float>::infinity(),
                           check_interrupt)) {}

std::vector<std::uint8_t> Canvas::resolve() const {
  const std::size_t width = width_ / kOversampling;
  const std::size_t height = height_ / kOversampling;
  std::vector<std::uint8_t> pixels;
  pixels.reserve(width * height * 3);
  for (std::size_t y = 0; y < height; ++y) {
    check_interrupt();
    for (std::size_t x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        float sum = 0;
        for (std::size_t dy = 0; dy < kOversampling; ++dy) {
          for (std::size_t dx = 0; dx < kOversampling; ++dx) {
            sum += colours_[(y * kOversampling + dy) * width_ + x * kOversampling + dx][c];
          }
        }
        constexpr float kSamples = kOversampling * kOversampling;
        pixels.push_back(static_cast<std::uint8_t>(
            std::lround(255.0F * std::clamp(sum / kSamples, 0.0F, 1.0F))));
      }
    }
  }
  return pixels;
}

Light Light::for_terrain(const ViewDirection& view, double relief) {
  const double azimuth = view.azimuth + 135;
  const double half = std::sqrt(0.5);
  return {.direction = {base::sin_degrees(azimuth) * half, base::cos_degrees(azimuth) * half, half},
          .relief = relief,
          .flat = half};
}

Light Light::headlight(const Camera& camera) {
  stream::Point3 direction{};
  for (std::size_t i = 0; i < 3; ++i) {
    direction[i] = camera.toward[i] + 0.45 * camera.up[i] - 0.45 * camera.right[i];
  }
  direction = unit(direction);
  return {.direction = direction, .relief = 1.0, .flat = dot(direction, camera.toward)};
}

float Light::shade(stream::Point3 normal, const stream::Point3& toward) const {
  if (dot(normal, toward) < 0) normal = {-normal[0], -normal[1], -normal[2]};
  normal[0] *= relief;
  normal[1] *= relief;
  normal = unit(normal);
  // Flat ground keeps its tint. Slopes toward the light become paler, others darker.
  const double lit = std::max(dot(normal, direction), 0.0) / flat;
  constexpr double kAmbient = 0.28;
  return static_cast<float>(kAmbient + (1 - kAmbient) * 0.92 * lit);
}

}  // namespace terrace::tools
