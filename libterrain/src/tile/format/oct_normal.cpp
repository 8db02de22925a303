// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tile/format/quantized_mesh.hpp"

namespace terrace::terrain {
namespace {

float with_sign(float magnitude, float sign) { return sign < 0.0F ? -magnitude : magnitude; }

std::uint8_t to_byte(float value) {
  const float unit = std::clamp(value, -1.0F, 1.0F) * 0.5F + 0.5F;
  return static_cast<std::uint8_t>(std::floor(unit * 255.0F + 0.5F));
}

float from_byte(std::uint8_t code) { return static_cast<float>(code) / 255.0F * 2.0F - 1.0F; }

}  // namespace

// The octahedron |x| + |y| + |z| = 1 seen from +z, with its lower half folded out over the corners.
std::array<std::uint8_t, 2> oct_encode(const std::array<float, 3>& direction) {
  const float sum = std::abs(direction[0]) + std::abs(direction[1]) + std::abs(direction[2]);
  float x = direction[0] / sum, y = direction[1] / sum;
  if (direction[2] < 0.0F) {
    const float folded_x = with_sign(1.0F - std::abs(y), x);
    y = with_sign(1.0F - std::abs(x), y);
    x = folded_x;
  }
  return {to_byte(x), to_byte(y)};
}

std::array<float, 3> oct_decode(const std::array<std::uint8_t, 2>& code) {
  float x = from_byte(code[0]), y = from_byte(code[1]);
  const float z = 1.0F - std::abs(x) - std::abs(y);
  if (z < 0.0F) {
    const float folded_x = with_sign(1.0F - std::abs(y), x);
    y = with_sign(1.0F - std::abs(x), y);
    x = folded_x;
  }
  const float length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

}  // namespace terrace::terrain
