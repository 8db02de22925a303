// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

#include "delaunay2/double_kernel.hpp"
#include "point_tin_oracle.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/instruction_set.hpp"
#include "tin/rows/padded_samples.hpp"

namespace terrace::tri {
namespace {

using planar::DoubleKernel;
using point_tin_oracle::check_delaunay;
using point_tin_oracle::kQualities;
using point_tin_oracle::rough;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

struct Grid {
  std::vector<double> x, y, z;

  [[nodiscard]] SampleRows rows() const { return {x, y, z}; }
};

/// The positions of all samples.
struct Places {
  std::vector<double> x, y;

  Places() = default;
  explicit Places(const Grid& grid) {
    for (std::size_t i = 0; i < grid.z.size(); ++i) {
      x.push_back(grid.x[i % grid.x.size()]);
      y.push_back(grid.y[i / grid.x.size()]);
    }
  }
};

struct Shape {
  std::size_t columns, rows;
  double extent;  ///< of the frame
  double first;   ///< position of the first column and row, in steps from the frame's side
};

/// `gaps`: the share of missing samples.
Grid make_grid(const Shape& shape, double gaps, std::uint64_t seed) {
  Grid grid;
  std::mt19937_64 random(seed);
  const auto places = [&](std::size_t count, std::vector<double>& out) {
    const double step = shape.extent / std::max(1.0, static_cast<double>(count - 1));
    for (std::size_t i = 0; i < count; ++i)
      out.push_back((static_cast<double>(i) + shape.first) * step);
  };
  places(shape.columns, grid.x);
  places(shape.rows, grid.y);
  for (const double y : grid.y) {
    for (const double x : grid.x) {
      const double u = x / shape.extent, v = y / shape.extent;
      const bool hole = std::hypot(u - 0.3, v - 0.6) < 0.1 && gaps > 0;
      const bool gap = hole || unit(random) < gaps;
      grid.z.push_back(gap ? kMissing : rough(u, v) + (u > 0.7 ? 30 : 0) + unit(random));
    }
  }
  return grid;
}

std::vector<Point3> make_frame(double extent, std::size_t per_side, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point3> frame;
  for (std::size_t side = 0; side < 4; ++side) {
    for (std::size_t k = 0; k < per_side; ++k) {
      const double t = std::floor(extent * static_cast<double>(k) / static_cast<double>(per_side));
      const double height = std::floor(20 * unit(random));
      if (side == 0) frame.push_back({t, 0, height});
      if (side == 1) frame.push_back({extent, t, height});
      if (side == 2) frame.push_back({extent - t, extent, height});
      if (side == 3) frame.push_back({0, extent - t, height});
    }
  }
  return frame;
}

PointTinOptions options_of(double error, TinQuality quality, double step = 0x1p-8) {
  PointTinOptions options;
  options.max_error = error;
  options.quality = quality;
  options.lattice = TinLattice{-100, step};
  return options;
}

/// Triangles must be counter-clockwise, and every edge must occur once in each direction, except
/// for those of the frame.
void check_framed_mesh(const PointTin& tin, const std::vector<Point3>& frame) {
  ASSERT_EQ(tin.sample.size(), tin.vertices.size());
  const auto place = [&](std::uint32_t v) {
    return std::array<double, 2>{tin.vertices[v][0], tin.vertices[v][1]};
  };
  std::set<std::array<std::uint32_t, 2>> edges;
  std::vector<bool> used(tin.vertices.size(), false);
  for (const auto& t : tin.triangles) {
    ASSERT_GT(DoubleKernel::orientation(place(t[0]), place(t[1]), place(t[2])), 0);
    for (std::size_t i = 0; i < 3; ++i) {
      used[t[i]] = true;
      ASSERT_TRUE(edges.insert({t[i], t[(i + 1) % 3]}).second) << "an edge has two left sides";
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0) << "unused vertices";
  std::size_t border = 0;
  for (const auto& e : edges) border += edges.contains({e[1], e[0]}) ? 0 : 1;
  ASSERT_EQ(border, frame.size());
  EXPECT_EQ(tin.triangles.size(), 2 * tin.vertices.size() - 2 - border);
  for (std::uint32_t i = 0; i < frame.size(); ++i) {
    EXPECT_EQ(tin.vertices[i], frame[i]);
    EXPECT_EQ(tin.sample[i], kNoSample);
    const auto next = static_cast<std::uint32_t>((i + 1) % frame.size());
    EXPECT_TRUE(edges.contains({i, next})) << "side " << i;
  }
}

/// Compares the errors that the TIN reports with measure_surface(), which does not depend on rows.
void check_errors(const Places& places, const std::vector<double>& heights, const PointTin& tin,
                  double bound) {
  std::vector<double> x, y, z;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (std::isnan(heights[i])) continue;
    x.push_back(places.x[i]);
    y.push_back(places.y[i]);
    z.push_back(heights[i]);
  }
  const TinErrors measured = measure_surface(x, y, z, tin.vertices, tin.triangles);
  EXPECT_EQ(tin.errors.covered, measured.covered);
  EXPECT_EQ(tin.errors.uncovered, measured.uncovered);
  EXPECT_NEAR(tin.errors.largest, measured.largest, 1e-9);
  EXPECT_NEAR(tin.errors.rms, measured.rms, 1e-9);
  if (tin.stuck == 0) {
    EXPECT_LE(tin.errors.largest, bound);
  }
  if (tin.errors.largest_at != kNoSample && measured.largest_at != kNoSample) {
    EXPECT_FALSE(std::isnan(heights.at(tin.errors.largest_at)));
  }
}

void check_lattice(const Places& places, const std::vector<double>& heights, const PointTin& tin,
                   const TinLattice& lattice) {
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
    const std::uint32_t s = tin.sample[v];
    if (s == kNoSample) continue;
    EXPECT_EQ(tin.vertices[v][0], std::floor(places.x[s] + 0.5));
    EXPECT_EQ(tin.vertices[v][1], std::floor(places.y[s] + 0.5));
    EXPECT_NEAR(tin.vertices[v][2], heights[s], lattice.height_step / 2);
    const double steps = (tin.vertices[v][2] - lattice.height_origin) / lattice.height_step;
    EXPECT_EQ(steps, std::floor(steps));
  }
}

TEST(PointRows, KeepTheErrorOnALattice) {
  const Shape shapes[] = {{60, 45, 32767, 0},  {33, 80, 32767, -4.3}, {64, 64, 300, 0.5},
                          {70, 70, 40, 0},     {7, 5, 32767, -0.4},   {120, 3, 1000, 0.2},
                          {2, 100, 1000, 0.1}, {80, 80, 1e6, -10.2}};
  for (const Shape& shape : shapes) {
    for (const double gaps : {0.0, 0.1}) {
      for (const double error : {0.7, 3.0, 30.0}) {
        for (const TinQuality quality : kQualities) {
          SCOPED_TRACE(std::to_string(shape.columns) + " x " + std::to_string(shape.rows) +
                       ", extent " + std::to_string(shape.extent) + ", gaps " +
                       std::to_string(gaps) + ", error " + std::to_string(error) + ", quality " +
                       std::to_string(static_cast<int>(quality)));
          const Grid grid = make_grid(shape, gaps, 3);
          const std::vector<Point3> frame = make_frame(shape.extent, 5, 4);
          const PointTinOptions options = options_of(error, quality);
          const PointTin tin = point_tin(grid.rows(), frame, options);
          check_framed_mesh(tin, frame);
          check_errors(Places(grid), grid.z, tin, error);
          if (quality != TinQuality::fitted)
            check_lattice(Places(grid), grid.z, tin, *options.lattice);
          if (quality == TinQuality::greedy && tin.vertices.size() < 800) check_delaunay(tin);
        }
      }
    }
  }
}

/// A grid rotated and bent, like rasters in other projections.
struct Bend {
  double degrees;
  bool mirrored;
  double bulge;  ///< share of the extent
};

Places bent(const Grid& grid, double extent, const Bend& bend) {
  Places places(grid);
  const double angle = bend.degrees * 3.14159265358979 / 180;
  for (std::size_t i = 0; i < places.x.size(); ++i) {
    const double u = places.x[i] / extent - 0.5, v = places.y[i] / extent - 0.5;
    const double bulged = u + bend.bulge * v * v, own = bend.mirrored ? -v : v;
    places.x[i] = (bulged * std::cos(angle) - own * std::sin(angle) + 0.5) * extent;
    places.y[i] = (bulged * std::sin(angle) + own * std::cos(angle) + 0.5) * extent;
  }
  return places;
}

constexpr Bend kBends[] = {{0, false, 0},      {0, true, 0},      {1.3, false, 0.002},
                           {-2.5, true, 0.01}, {30, false, 0.02}, {90, false, 0.1},
                           {180, true, 0.004}, {0, false, 1.0}};

TEST(PointRows, TurnedAndBentGridsKeepTheError) {
  for (const Shape& shape : {Shape{60, 45, 32767, 0},
                             {64, 64, 300, 0.5},
                             {60, 80, 40, -3.2},
                             {120, 3, 1000, 0.2},
                             {2, 100, 1000, 0.1},
                             {90, 90, 32767, -20}}) {
    for (const Bend& bend : kBends) {
      for (const double error : {2.0}) {
        for (const TinQuality quality : kQualities) {
          SCOPED_TRACE(std::to_string(shape.columns) + " x " + std::to_string(shape.rows) +
                       ", extent " + std::to_string(shape.extent) + ", turned by " +
                       std::to_string(bend.degrees) + ", mirrored " +
                       std::to_string(bend.mirrored) + ", bulge " + std::to_string(bend.bulge) +
                       ", error " + std::to_string(error) + ", quality " +
                       std::to_string(static_cast<int>(quality)));
          Grid grid = make_grid(shape, 0.05, 3);
          Places places = bent(grid, shape.extent, bend);
          // A sample without a position has no height.
          places.x[5] = places.y[5] = grid.z[5] = kMissing;
          const std::vector<Point3> frame = make_frame(shape.extent, 5, 4);
          const PointTinOptions options = options_of(error, quality);
          const PointTin tin =
              point_tin(SampleGrid{shape.columns, places.x, places.y, grid.z}, frame, options);
          check_framed_mesh(tin, frame);
          check_errors(places, grid.z, tin, error);
          if (quality != TinQuality::fitted) check_lattice(places, grid.z, tin, *options.lattice);
          if (quality == TinQuality::greedy && tin.vertices.size() < 800) check_delaunay(tin);
        }
      }
    }
  }
}

TEST(PointRows, HaveAsFewTrianglesAsPointTins) {
  const Grid grid = make_grid({300, 300, 32767, 0}, 0.0, 5);
  const std::vector<Point3> frame = make_frame(32767, 9, 6);
  std::vector<double> x, y;
  for (std::size_t i = 0; i < grid.z.size(); ++i) {
    x.push_back(grid.x[i % grid.x.size()]);
    y.push_back(grid.y[i / grid.x.size()]);
  }
  for (const double error : {0.7, 2.0, 10.0}) {
    for (const TinQuality quality : {TinQuality::greedy, TinQuality::removal}) {
      SCOPED_TRACE("error " + std::to_string(error) + ", quality " +
                   std::to_string(static_cast<int>(quality)));
      const PointTinOptions options = options_of(error, quality);
      const PointTin tin = point_tin(grid.rows(), frame, options);
      const PointTin from_points = point_tin(x, y, grid.z, frame, options);
      // Sweeps insert points before removal, which leaves a few per cent less here.
      const double max_ratio = quality == TinQuality::removal ? 1.08 : 1.04;
      EXPECT_LE(static_cast<double>(tin.triangles.size()),
                max_ratio * static_cast<double>(from_points.triangles.size()));
      if (quality == TinQuality::removal) {
        EXPECT_GT(tin.removed, tin.inserted / 5);
        EXPECT_EQ(tin.vertices.size(), frame.size() + tin.inserted - tin.removed);
      }
    }
  }
}

void expect_same(const PointTin& a, const PointTin& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.sample, b.sample);
  EXPECT_EQ(a.errors.largest, b.errors.largest);
  EXPECT_EQ(a.errors.rms, b.errors.rms);
  EXPECT_EQ(a.errors.largest_at, b.errors.largest_at);
}

TEST(PointRows, AllInstructionSetsGiveTheSame) {
  for (const double gaps : {0.0, 0.05}) {
    for (const double extent : {32767.0, 100.0}) {
      SCOPED_TRACE("gaps " + std::to_string(gaps) + ", extent " + std::to_string(extent));
      const Grid grid = make_grid({150, 170, extent, -2.7}, gaps, 7);
      const Places places = bent(grid, extent, {2, true, 0.003});
      const SampleGrid turned{150, places.x, places.y, grid.z};
      const std::vector<Point3> frame = make_frame(extent, 3, 8);
      ASSERT_TRUE(tin::rows::padded_samples(grid.rows(), frame));
      ASSERT_TRUE(tin::rows::padded_samples(turned, frame));
      const PointTinOptions options = options_of(1.0, TinQuality::removal);
      const auto from_rows = [&](base::SimdPath set) {
        return tin::rows::make_tin(grid.rows(), frame, options, set);
      };
      const auto from_turned = [&](base::SimdPath set) {
        return tin::rows::make_tin(turned, frame, options, set);
      };
      EXPECT_GT(from_rows(base::SimdPath::portable).triangles.size(), 100u);
      EXPECT_GT(from_turned(base::SimdPath::portable).triangles.size(), 100u);
      for (const base::SimdPath set : {base::SimdPath::avx2, base::SimdPath::avx512}) {
        if (!base::supports(set)) continue;
        expect_same(from_rows(base::SimdPath::portable), from_rows(set));
        expect_same(from_turned(base::SimdPath::portable), from_turned(set));
      }
    }
  }
}

// Several samples per position of the lattice, with cliffs between them.
TEST(PointRows, ReportLatticesTooCoarseForTheError) {
  Grid grid = make_grid({120, 120, 20, 0}, 0.0, 9);
  std::mt19937_64 random(9);
  for (double& z : grid.z) z = 100 * unit(random);
  const std::vector<Point3> frame = make_frame(20, 1, 10);
  for (const TinQuality quality : {TinQuality::greedy, TinQuality::removal}) {
    const PointTin tin = point_tin(grid.rows(), frame, options_of(1.0, quality));
    check_framed_mesh(tin, frame);
    check_errors(Places(grid), grid.z, tin, 1.0);
    EXPECT_GT(tin.stuck, 1000u);
    EXPECT_GT(tin.vertices.size(), 300u);
  }
}

TEST(PointRows, KeepAnErrorOfZero) {
  const Grid grid = make_grid({20, 20, 1000, 0}, 0.1, 11);
  const std::vector<Point3> frame = make_frame(1000, 2, 12);
  const PointTin tin = point_tin(grid.rows(), frame, options_of(0.0, TinQuality::removal));
  check_framed_mesh(tin, frame);
  check_errors(Places(grid), grid.z, tin, 0.0);
  // All samples inside are vertices, as their heights are rounded.
  EXPECT_GT(tin.vertices.size(), 250u);
}

TEST(PointRows, SamplesOnTheFrameAndAHairOutside) {
  Grid grid;
  grid.x = {0, 250, 500, 750, std::nextafter(1000.0, 2000.0)};
  grid.y = {std::nextafter(0.0, -1.0), 250, 500, 750, 1000};
  grid.z.assign(25, 0.0);
  const std::vector<Point3> frame{{0, 0, 0}, {1000, 0, 0}, {1000, 1000, 0}, {0, 1000, 0}};
  const PointTin flat = point_tin(grid.rows(), frame, options_of(0.5, TinQuality::greedy));
  EXPECT_EQ(flat.errors.covered, 16u);
  EXPECT_EQ(flat.errors.uncovered, 9u);
  EXPECT_EQ(flat.triangles.size(), 2u);
  // Beyond the bound outside, on a side, and inside.
  grid.z[4] = grid.z[9] = grid.z[22] = grid.z[12] = 300;
  const PointTin tin = point_tin(grid.rows(), frame, options_of(0.5, TinQuality::greedy));
  check_framed_mesh(tin, frame);
  check_errors(Places(grid), grid.z, tin, 0.5);
  EXPECT_EQ(tin.stuck, 1u);
  EXPECT_EQ(tin.errors.largest_at, 22u);
  EXPECT_EQ(std::count(tin.sample.begin(), tin.sample.end(), 12u), 1);
}

TEST(PointRows, HandleFewSamples) {
  const std::vector<Point3> frame{{0, 0, 1}, {10, 0, 2}, {10, 10, 3}, {0, 10, 4}};
  const PointTinOptions options = options_of(0.5, TinQuality::removal);
  Grid grid;
  EXPECT_EQ(point_tin(grid.rows(), frame, options).triangles.size(), 2u);
  grid.x = {5};
  grid.y = {4};
  grid.z = {100};
  const PointTin one = point_tin(grid.rows(), frame, options);
  check_framed_mesh(one, frame);
  EXPECT_EQ(one.triangles.size(), 4u);
  EXPECT_EQ(one.errors.covered, 1u);
  grid.z = {kMissing};
  const PointTin none = point_tin(grid.rows(), frame, options);
  EXPECT_EQ(none.triangles.size(), 2u);
  EXPECT_EQ(none.errors.covered + none.errors.uncovered, 0u);
  grid.x = {2, 4, 6, 8};
  grid.z = {0, 50, kMissing, 7};
  const PointTin row = point_tin(grid.rows(), frame, options);
  check_framed_mesh(row, frame);
  check_errors(Places(grid), grid.z, row, 0.5);
  EXPECT_EQ(row.errors.covered, 3u);
}

// Inputs that the fast path does not support take the other one, with the numbers of rows and
// columns.
TEST(PointRows, AcceptIrregularPlacesAndFrames) {
  Grid grid = make_grid({40, 40, 1000, 0}, 0.05, 13);
  grid.x[7] += 10;
  const std::vector<Point3> frame = make_frame(1000, 2, 14);
  const PointTinOptions options = options_of(1.0, TinQuality::removal);
  const PointTin uneven = point_tin(grid.rows(), frame, options);
  check_framed_mesh(uneven, frame);
  check_errors(Places(grid), grid.z, uneven, 1.0);
  check_lattice(Places(grid), grid.z, uneven, *options.lattice);
  const std::vector<Point3> triangle{{0, 0, 1}, {1000, 0, 2}, {0, 1000, 3}};
  const Grid even = make_grid({40, 40, 1000, 0}, 0.0, 13);
  const PointTin part = point_tin(even.rows(), triangle, options);
  check_framed_mesh(part, triangle);
  check_errors(Places(even), even.z, part, 1.0);
  EXPECT_GT(part.errors.uncovered, 0u);
  PointTinOptions limited = options;
  limited.max_points = 50;
  EXPECT_LE(point_tin(even.rows(), frame, limited).vertices.size(), 50u);
  PointTinOptions free = options;
  free.lattice.reset();
  check_errors(Places(even), even.z, point_tin(even.rows(), {}, free), 1.0);
}

TEST(PointRows, RejectBadInput) {
  Grid grid = make_grid({10, 10, 1000, 0}, 0.0, 15);
  const std::vector<Point3> frame = make_frame(1000, 1, 16);
  const PointTinOptions options = options_of(1.0, TinQuality::greedy);
  const auto expect_refused = [&](const std::string& what) {
    try {
      static_cast<void>(point_tin(grid.rows(), frame, options));
    } catch (const std::invalid_argument& error) {
      return std::string(error.what()).find(what) != std::string::npos;
    }
    return false;
  };
  grid.z[37] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(expect_refused("z of sample 37"));
  grid.z.pop_back();
  EXPECT_TRUE(expect_refused("row and column"));
  grid = make_grid({10, 10, 1000, 0}, 0.0, 15);
  grid.x[3] = kMissing;
  EXPECT_TRUE(expect_refused("x of sample"));
  PointTinOptions bad = options;
  bad.max_error = -1;
  const Grid valid_grid = make_grid({10, 10, 1000, 0}, 0.0, 15);
  const Places places(valid_grid);
  EXPECT_THROW(
      static_cast<void>(point_tin(SampleGrid{7, places.x, places.y, valid_grid.z}, frame, options)),
      std::invalid_argument);
  EXPECT_THROW(static_cast<void>(
                   point_tin(SampleGrid{10, places.x, valid_grid.y, valid_grid.z}, frame, options)),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(point_tin(SampleGrid{0, {}, {}, valid_grid.z}, frame, options)),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(point_tin(grid.rows(), frame, bad)), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::tri
