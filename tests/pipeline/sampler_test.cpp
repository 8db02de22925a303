// SPDX-License-Identifier: GPL-3.0-or-later
// Compares heights at positions of a raster with libtri's interpolation on the Delaunay
// triangulation of all its samples; holes are left out.
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/interpolation.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace {
namespace {

using terrain::Point2;
using tri::Interpolation;

struct Raster {
  std::uint32_t columns = 0, rows = 0;
  bool holes = false, doubles = false;
};

class Sampler : public testing::TestWithParam<Raster> {
 protected:
  void SetUp() override {
    const Raster raster = GetParam();
    stream::GeoTiffOptions options;
    options.columns = raster.columns;
    options.rows = raster.rows;
    options.sample.type = raster.doubles ? stream::ScalarType::f64 : stream::ScalarType::f32;
    options.world.xy = {10, 0, 500000, 0, -10, 5200000};
    options.nodata = -9999;
    std::mt19937_64 random(11);
    for (std::uint32_t row = 0; row < raster.rows; ++row) {
      for (std::uint32_t column = 0; column < raster.columns; ++column) {
        const bool hole =
            raster.holes && (random() % 6 == 0 || std::hypot(column - 40.0, row - 30.0) < 12);
        const double height =
            300 + 20 * std::sin(column / 7.0) + static_cast<double>(random() % 64) / 8;
        // Exact in float.
        heights_.push_back(hole ? NAN : static_cast<double>(static_cast<float>(height)));
      }
    }
    const auto file = folder_.path() / "dem.tif";
    stream::GeoTiffWriter writer(file, options);
    std::vector<float> floats;
    std::vector<double> doubles;
    for (const double h : heights_) {
      doubles.push_back(std::isnan(h) ? -9999 : h);
      floats.push_back(static_cast<float>(doubles.back()));
    }
    writer.write_rows(raster.doubles ? std::as_bytes(std::span(doubles))
                                     : std::as_bytes(std::span(floats)));
    writer.commit();
    terrain::BuildRequest request;
    request.inputs = {file.string()};
    request.store = folder_.path() / "dem.store";
    request.block_points = 1000;
    request.facility_cost = 1.0;
    terrain::build_store(request);
    std::vector<std::array<std::int32_t, 2>> points;
    std::vector<double> at;
    for (std::size_t i = 0; i < heights_.size(); ++i) {
      if (std::isnan(heights_[i])) continue;
      points.push_back({static_cast<std::int32_t>(i % raster.columns),
                        static_cast<std::int32_t>(i / raster.columns)});
      at.push_back(heights_[i]);
    }
    const std::vector<tri::VertexId> vertices = triangulation_.build(points);
    slots_.assign(triangulation_.vertex_slots(), NAN);
    for (std::size_t i = 0; i < at.size(); ++i) slots_[tri::slot(vertices[i])] = at[i];
  }

  [[nodiscard]] std::vector<Point2> places(std::uint64_t seed, std::size_t count) const {
    std::mt19937_64 random(seed);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    std::vector<Point2> places;
    for (std::size_t i = 0; i < count; ++i) {
      Point2 p{unit() * (GetParam().columns + 1.0) - 1, unit() * (GetParam().rows + 1.0) - 1};
      // A quarter each on samples, columns and diagonals; the rest anywhere.
      if (i % 4 == 1) p = {std::round(p[0]), std::round(p[1])};
      if (i % 4 == 2) p[0] = std::round(p[0]);
      if (i % 4 == 3) p = {std::floor(p[0]) + 0.25, std::floor(p[1]) + 0.75};
      places.push_back(p);
    }
    return places;
  }

  /// Returns the answers, and checks that they depend neither on threads nor on the other
  /// positions.
  [[nodiscard]] std::vector<terrain::SurfacePoint> sampled(
      Interpolation method, const std::vector<Point2>& places) const {
    const stream::Store store = stream::Store::open(folder_.path() / "dem.store");
    std::vector<terrain::SurfacePoint> out(places.size()), again(places.size());
    terrain::make_sampler(store, {.method = method})->sample(places, out);
    const auto many = terrain::make_sampler(store, {.method = method}, {.threads = 3});
    for (std::size_t begin = 0; begin < places.size(); begin += 90) {
      const std::size_t size = std::min<std::size_t>(90, places.size() - begin);
      many->sample(std::span(places).subspan(begin, size), std::span(again).subspan(begin, size));
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto same = [](double a, double b) {
        return a == b || (std::isnan(a) && std::isnan(b));
      };
      EXPECT_TRUE(same(out[i].height, again[i].height) &&
                  same(out[i].per_column, again[i].per_column) &&
                  same(out[i].per_row, again[i].per_row))
          << i;
    }
    return out;
  }

  tests::TemporaryFolder folder_;
  std::vector<double> heights_;
  tri::Delaunay2<std::int32_t> triangulation_;
  std::vector<double> slots_;
};

void expect_near(double got, double expected, std::size_t i) {
  if (std::isnan(expected)) {
    EXPECT_TRUE(std::isnan(got)) << "place " << i << ": " << got;
  } else {
    EXPECT_NEAR(got, expected, 1e-8) << "place " << i;
  }
}

TEST_P(Sampler, LinearMatchesTheTriangulation) {
  const std::vector<Point2> queries = places(21, 4000);
  const auto got = sampled(Interpolation::linear, queries);
  const auto heights = tri::heights_at(triangulation_, slots_, queries, Interpolation::linear, 1);
  const auto gradients =
      tri::gradients_at(triangulation_, slots_, queries, tri::GradientFrom::triangles, 1);
  std::size_t compared = 0, without = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (GetParam().holes) {
      // The triangulation also spans holes, so it is an oracle only strictly inside triangles of
      // the lattice.
      if (i % 4 != 0) continue;
      std::vector<tri::VertexWeight> weights;
      tri::weights_at(triangulation_, queries[i], Interpolation::linear, weights);
      bool small = weights.size() == 3;
      for (const tri::VertexWeight& w : weights) {
        const auto p = triangulation_.point(w.vertex);
        small = small && p[0] >= std::floor(queries[i][0]) && p[0] <= std::ceil(queries[i][0]) &&
                p[1] >= std::floor(queries[i][1]) && p[1] <= std::ceil(queries[i][1]);
      }
      if (!small) {
        EXPECT_TRUE(std::isnan(got[i].height)) << i;
        ++without;
        continue;
      }
    }
    expect_near(got[i].height, heights[i], i);
    expect_near(got[i].per_column, gradients[i].x, i);
    expect_near(got[i].per_row, gradients[i].y, i);
    ++compared;
  }
  EXPECT_GT(compared, 300u);
  EXPECT_TRUE(!GetParam().holes || without > 100u);
}

TEST_P(Sampler, NaturalMatchesTheFullLattice) {
  if (GetParam().holes) {
    // There is no value where a neighbour has no data; elsewhere holes do not matter.
    const std::vector<Point2> queries = places(22, 1000);
    const auto got = sampled(Interpolation::natural_neighbour, queries);
    std::size_t with = 0, without = 0;
    for (std::size_t i = 0; i < queries.size(); i += 4) {
      if (queries[i][0] < 0 || queries[i][1] < 0) continue;
      // A corner without data is always a neighbour of a position inside the square.
      bool hole = false;
      for (unsigned corner = 0; corner < 4; ++corner) {
        const auto column = static_cast<std::size_t>(queries[i][0]) + (corner & 1);
        const auto row = static_cast<std::size_t>(queries[i][1]) + (corner >> 1);
        hole = hole || column >= GetParam().columns || row >= GetParam().rows ||
               std::isnan(heights_[row * GetParam().columns + column]);
      }
      EXPECT_TRUE(!hole || std::isnan(got[i].height)) << i;
      (std::isnan(got[i].height) ? without : with)++;
    }
    EXPECT_GT(with, 20u);
    EXPECT_GT(without, 20u);
    return;
  }
  const std::vector<Point2> queries = places(23, 2000);
  const auto got = sampled(Interpolation::natural_neighbour, queries);
  const auto heights =
      tri::heights_at(triangulation_, slots_, queries, Interpolation::natural_neighbour, 1);
  const auto gradients =
      tri::gradients_at(triangulation_, slots_, queries, tri::GradientFrom::natural_neighbours, 1);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    expect_near(got[i].height, heights[i], i);
    expect_near(got[i].per_column, gradients[i].x, i);
    expect_near(got[i].per_row, gradients[i].y, i);
  }
}

TEST_P(Sampler, NearestReturnsTheSampleOfTheCell) {
  const std::vector<Point2> queries = places(24, 2000);
  const auto got = sampled(Interpolation::nearest, queries);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const auto last = [](std::uint32_t n) { return static_cast<double>(n - 1); };
    const bool inside = queries[i][0] >= -0.5 && queries[i][1] >= -0.5 &&
                        queries[i][0] <= last(GetParam().columns) + 0.5 &&
                        queries[i][1] <= last(GetParam().rows) + 0.5;
    const double column =
        std::clamp(std::floor(queries[i][0] + 0.5), 0.0, last(GetParam().columns));
    const double row = std::clamp(std::floor(queries[i][1] + 0.5), 0.0, last(GetParam().rows));
    const auto at = static_cast<std::size_t>(row * GetParam().columns + column);
    expect_near(got[i].height, inside ? heights_[at] : NAN, i);
  }
}

TEST_P(Sampler, NonFinitePositionsHaveNoHeight) {
  const std::vector<Point2> queries{{NAN, 3}, {3, INFINITY}, {-INFINITY, NAN}, {1e300, 1e300}};
  for (const Interpolation method :
       {Interpolation::linear, Interpolation::nearest, Interpolation::natural_neighbour}) {
    for (const terrain::SurfacePoint& p : sampled(method, queries))
      EXPECT_TRUE(std::isnan(p.height));
    EXPECT_TRUE(sampled(method, {}).empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Rasters, Sampler,
                         testing::Values(Raster{150, 130, false, false},
                                         Raster{150, 130, true, false}, Raster{97, 60, false, true},
                                         Raster{40, 33, true, true}));

}  // namespace
}  // namespace terrace
