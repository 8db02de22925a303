// SPDX-License-Identifier: GPL-3.0-or-later
// The same landscape in degrees, in feet and in oblong cells clusters like its twin in metres,
// because distances are measured on the ground.
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "earth/ground.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace {
namespace {

constexpr double kExtent = 9000.0;  // metres, both ways
constexpr double kSurveyFoot = 1200.0 / 3937.0;

/// Hills of some hundred metres; x and y in metres.
double height_at(double x, double y) {
  return 800 + 150 * std::sin(x / 700) * std::cos(y / 900) + 90 * std::sin((x + 2 * y) / 410) +
         40 * std::cos((3 * x - y) / 230);
}

struct Twin {
  std::uint32_t columns, rows;
  double unit_x, unit_y, unit_z;  ///< metres per unit of x, y, z
  double x0, y0;                  ///< of the upper left sample, in those units
  std::string crs;
};

struct Shape {
  double clusters = 0, mean_error = 0, width = 0, depth = 0;  ///< means over level 0, metres
};

Shape cluster(const Twin& twin, const std::filesystem::path& folder) {
  const double cell_x = kExtent / twin.columns, cell_y = kExtent / twin.rows;  // metres
  stream::GeoTiffOptions options;
  options.columns = twin.columns;
  options.rows = twin.rows;
  options.sample.type = stream::ScalarType::f32;
  options.world.xy = {cell_x / twin.unit_x, 0, twin.x0, 0, -cell_y / twin.unit_y, twin.y0};
  options.crs = terrain::CoordinateSystem::parse(twin.crs).crs();
  options.replace = true;
  std::vector<float> samples;
  for (std::uint32_t row = 0; row < twin.rows; ++row) {
    for (std::uint32_t column = 0; column < twin.columns; ++column) {
      samples.push_back(static_cast<float>(height_at(column * cell_x, row * cell_y) / twin.unit_z));
    }
  }
  stream::GeoTiffWriter writer(folder / "dem.tif", options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();

  terrain::BuildRequest request;
  request.inputs = {(folder / "dem.tif").string()};
  request.store = folder / "dem.store";
  request.replace = true;
  request.crs = options.crs;
  if (twin.unit_z != 1.0) request.crs->vertical_unit = "US survey foot";
  terrain::build_store(request);

  const stream::Store store = stream::Store::open(request.store);
  Shape shape;
  store.for_each(
      0, [&](stream::ClusterId, const stream::ClusterRecord& record, const stream::ClusterPoints&) {
        shape.clusters += 1;
        shape.mean_error += record.summary.error;
        shape.width += (record.summary.box.max[0] - record.summary.box.min[0] + 1) * cell_x;
        shape.depth += (record.summary.box.max[1] - record.summary.box.min[1] + 1) * cell_y;
      });
  shape.mean_error /= shape.clusters;
  shape.width /= shape.clusters;
  shape.depth /= shape.clusters;
  return shape;
}

class Twins : public testing::Test {
 protected:
  tests::TemporaryFolder folder_;
  const Shape metres_ = cluster({300, 300, 1, 1, 1, 500000, 6650000, "EPSG:32632"}, folder_.path());

  void expect_like_metres(const Shape& twin) const {
    EXPECT_NEAR(twin.clusters / metres_.clusters, 1.0, 0.03);
    EXPECT_NEAR(twin.mean_error / metres_.mean_error, 1.0, 0.03);
    EXPECT_NEAR(twin.width / metres_.width, 1.0, 0.03);
    EXPECT_NEAR(twin.depth / metres_.depth, 1.0, 0.03);
  }
};

TEST_F(Twins, MetresMakeClustersAsWideAsDeep) {
  EXPECT_GT(metres_.clusters, 100);
  EXPECT_NEAR(metres_.width / metres_.depth, 1.0, 0.1);
}

TEST_F(Twins, DegreesClusterLikeMetres) {
  // At 60 degrees north, a degree of longitude is half as long as a degree of latitude.
  const terrain::MetresPerDegree degree = terrain::metres_per_degree(60.0);
  expect_like_metres(cluster({300, 300, degree.longitude, degree.latitude, 1, 10.0,
                              60.0 + kExtent / 2 / degree.latitude, "EPSG:4326"},
                             folder_.path()));
}

TEST_F(Twins, FeetClusterLikeMetres) {
  expect_like_metres(
      cluster({300, 300, kSurveyFoot, kSurveyFoot, kSurveyFoot, 900000, 200000, "EPSG:2263"},
              folder_.path()));
}

TEST_F(Twins, OblongCellsMakeClustersAsWideAsDeep) {
  const Shape oblong = cluster({600, 150, 1, 1, 1, 500000, 6650000, "EPSG:32632"}, folder_.path());
  EXPECT_NEAR(oblong.width / oblong.depth, 1.0, 0.15);
  EXPECT_NEAR(oblong.clusters / metres_.clusters, 1.0, 0.1);
}

}  // namespace
}  // namespace terrace
