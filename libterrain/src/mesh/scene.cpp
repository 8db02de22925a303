// SPDX-License-Identifier: Apache-2.0
#include "mesh/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <terrace/base/filled.hpp>
#include <terrace/base/portable_math.hpp>
#include <terrace/base/stop_check.hpp>

#include "base/steepness.hpp"
#include "base/vector.hpp"

namespace terrace::terrain {

stream::Point3 area_vector(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return cross(difference(mesh.positions[t[1]], mesh.positions[t[0]]),
               difference(mesh.positions[t[2]], mesh.positions[t[0]]));
}

bool is_height_field(const TriangleMesh& mesh, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  double up = 0, down = 0;
  for (const auto& t : mesh.triangles) {
    ticks(8);
    const double z = area_vector(mesh, t)[2];
    (z > 0 ? up : down) += std::abs(z);
  }
  return std::max(up, down) > 0 && std::min(up, down) < 0.001 * std::max(up, down);
}

bool mostly_steep(const TriangleMesh& mesh, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  Steepness steepness;
  for (const auto& t : mesh.triangles) {
    ticks(8);
    steepness.add(area_vector(mesh, t));
  }
  return steepness.mostly();
}

double rms_slope(const TriangleMesh& mesh, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  double sum = 0, area = 0;
  for (const auto& t : mesh.triangles) {
    const stream::Point3 n = area_vector(mesh, t);
    ticks(8);
    const double flat = std::abs(n[2]);
    if (flat <= 0) continue;
    sum += (n[0] * n[0] + n[1] * n[1]) / flat;
    area += flat;
  }
  return area > 0 ? std::sqrt(sum / area) : 0;
}

namespace {

constexpr std::size_t kShownHeights = 100000;

std::vector<double> heights_by_area(const TriangleMesh& mesh, const std::vector<double>& heights,
                                    bool flat, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  std::vector<double> areas;
  areas.reserve(mesh.triangles.size());
  double total = 0;
  for (const auto& t : mesh.triangles) {
    const stream::Point3 n = area_vector(mesh, t);
    ticks(8);
    const double area = flat ? std::abs(n[2]) : base::hypot(base::hypot(n[0], n[1]), n[2]);
    areas.push_back(std::isfinite(area) ? area : 0.0);
    total += areas.back();
  }
  std::vector<double> shown;
  const double each = total / static_cast<double>(kShownHeights);
  // With subnormal areas, steps may round to 0.
  if (!(each >= std::numeric_limits<double>::min()) || !std::isfinite(total)) return shown;
  double before = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    ticks(4);
    const auto& t = mesh.triangles[i];
    const double after = before + areas[i];
    // Distributes places evenly in a triangle (M. Roberts's sequence in two dimensions).
    for (std::size_t k = shown.size(); (static_cast<double>(k) + 0.5) * each < after; ++k) {
      double u = std::fmod(static_cast<double>(k) * 0.7548776662466927, 1.0);
      double v = std::fmod(static_cast<double>(k) * 0.5698402909980532, 1.0);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      shown.push_back((1 - u - v) * heights[t[0]] + u * heights[t[1]] + v * heights[t[2]]);
    }
    before = after;
  }
  return shown;
}

/// Samples each cell of space that has points. Where points are sparse, a cell has about four.
std::vector<double> heights_by_cells(const TriangleMesh& cloud, const std::vector<double>& heights,
                                     const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  constexpr double kMaxCells = 64;  // along a side
  std::array<std::size_t, 256> groups{};
  for (const std::uint8_t left_out : cloud.left_out) ++groups[left_out];
  const std::size_t coarsest =
      *std::find_if(groups.rbegin(), groups.rend(), [](std::size_t count) { return count > 0; });
  const double cells =
      std::clamp(std::floor(std::sqrt(static_cast<double>(coarsest) / 4)), 1.0, kMaxCells);
  stream::Box3 box;
  for (const stream::Point3& p : cloud.positions) {
    ticks(4);
    box.include(p);
  }
  double width = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    width = std::max(width, box.max[axis] - box.min[axis]);
  }
  std::vector<std::vector<double>> members(static_cast<std::size_t>(cells * cells * cells));
  for (std::size_t i = 0; i < heights.size(); ++i) {
    ticks(16);
    double cell = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double place = cloud.positions[i][axis] - box.min[axis];
      cell =
          cell * cells + (width > 0 ? std::min(cells - 1, std::floor(place / width * cells)) : 0);
    }
    members[static_cast<std::size_t>(cell)].push_back(heights[i]);
  }
  std::erase_if(members,
                [](const std::vector<double>& coordinates) { return coordinates.empty(); });
  const std::size_t of_each = std::max<std::size_t>(1, kShownHeights / members.size());
  std::vector<double> shown;
  for (const std::vector<double>& coordinates : members) {
    for (std::size_t k = 0; k < of_each; ++k)
      shown.push_back(coordinates[k * coordinates.size() / of_each]);
  }
  return shown;
}

}  // namespace

std::vector<double> shown_heights(const TriangleMesh& mesh, const std::vector<double>& heights,
                                  bool flat, const base::StopCheck& check_stop) {
  std::vector<double> shown;
  if (!mesh.triangles.empty()) {
    shown = heights_by_area(mesh, heights, flat, check_stop);
  } else if (!mesh.left_out.empty()) {
    shown = heights_by_cells(mesh, heights, check_stop);
  }
  if (!shown.empty()) return shown;
  const std::size_t stride = heights.size() / kShownHeights + 1;
  for (std::size_t i = 0; i < heights.size(); i += stride) shown.push_back(heights[i]);
  return shown;
}

std::vector<std::array<float, 3>> vertex_normals(const TriangleMesh& mesh,
                                                 const base::StopCheck& check_stop) {
  std::vector<stream::Point3> sums =
      base::filled(mesh.positions.size(), stream::Point3{}, check_stop);
  base::StopTicks ticks(check_stop);
  double up = 0;
  for (const auto& t : mesh.triangles) {
    const stream::Point3 n = area_vector(mesh, t);
    ticks(16);
    up += n[2];
    for (const std::uint32_t v : t) {
      for (std::size_t axis = 0; axis < 3; ++axis) sums[v][axis] += n[axis];
    }
  }
  const double sign = up < 0 && is_height_field(mesh, check_stop) ? -1 : 1;
  std::vector<std::array<float, 3>> normals =
      base::filled(sums.size(), std::array<float, 3>{}, check_stop);
  for (std::size_t v = 0; v < sums.size(); ++v) {
    ticks(8);
    const double length =
        std::sqrt(sums[v][0] * sums[v][0] + sums[v][1] * sums[v][1] + sums[v][2] * sums[v][2]);
    if (length > 0) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        normals[v][axis] = static_cast<float>(sign * sums[v][axis] / length);
      }
    } else {
      normals[v] = {0, 0, 1};
    }
  }
  return normals;
}

}  // namespace terrace::terrain
