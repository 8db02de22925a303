// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "format/registry.hpp"
#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "tiff_writing.hpp"

namespace terrace::stream {
namespace {

using Cells = std::map<std::pair<std::int64_t, std::int64_t>, double>;

RasterOpener plain_opener() {
  return [](const std::string& file) { return open_geotiff(file); };
}

/// Rasters of the same grid in one folder.
class Files {
 public:
  std::string add(const TiffSpec& spec, const std::vector<std::byte>& samples) {
    const std::string name =
        (folder_.path() / ("f" + std::to_string(names_.size()) + ".tif")).string();
    write_tiff(name, spec, samples);
    names_.push_back(name);
    return name;
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  TempFolder folder_;
  std::vector<std::string> names_;
};

/// Random rasters with holes and overlaps, compared with a map from place to last sample.
TEST(Mosaic, TheLastValidSampleWinsAndEachCellIsOnePoint) {
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    Files files;
    Cells expected;
    const double cell = seed % 2 == 0 ? 30.0 : 1.0 / 1200.0;
    std::int64_t left = INT64_MAX, top = INT64_MAX, right = INT64_MIN, bottom = INT64_MIN;
    const std::size_t count = 1 + random() % 6;
    for (std::size_t f = 0; f < count; ++f) {
      TiffSpec spec;
      spec.columns = 1 + static_cast<std::uint32_t>(random() % 60);
      spec.rows = 1 + static_cast<std::uint32_t>(random() % 60);
      const auto column = static_cast<std::int64_t>(random() % 100);
      const auto row = static_cast<std::int64_t>(random() % 100);
      if (random() % 2 == 0) spec.tile_columns = spec.tile_rows = 16;
      if (random() % 2 == 0) spec.compression = COMPRESSION_ADOBE_DEFLATE;
      const auto hole =
          static_cast<std::int16_t>(random() % 3);  // each file has its own nodata value
      const auto place = placed_at(7 + static_cast<double>(column) * cell,
                                   50 - static_cast<double>(row) * cell, cell);
      spec.more = [&](TIFF* tiff) {
        place(tiff);
        TIFFSetField(tiff, 42113, std::to_string(hole).c_str());
      };
      std::vector<std::int16_t> values(std::size_t{spec.columns} * spec.rows);
      for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = static_cast<std::int16_t>(random() % 8);
        if (values[i] == hole) continue;
        const auto c = column + static_cast<std::int64_t>(i % spec.columns);
        const auto r = row + static_cast<std::int64_t>(i / spec.columns);
        expected[{c, r}] = values[i];
      }
      left = std::min(left, column);
      top = std::min(top, row);
      right = std::max(right, column + spec.columns);
      bottom = std::max(bottom, row + spec.rows);
      files.add(spec, as_samples(values));
    }
    SourceOptions options;
    options.block_points = 1 + random() % 300;
    options.memory_bytes = 1000 + random() % 100000;
    const auto source =
        points_of(open_mosaic(files.names(), plain_opener(), std::nullopt, 1 + random() % 3,
                              random() % 2 == 0 ? random() % 100000 : std::uint64_t{1} << 30),
                  options);
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.columns, static_cast<std::uint64_t>(right - left));
    EXPECT_EQ(info.rows, static_cast<std::uint64_t>(bottom - top));
    EXPECT_EQ(info.files, files.names());
    EXPECT_NEAR(info.world.xy[2], 7 + (static_cast<double>(left) + 0.5) * cell, 1e-9);
    EXPECT_NEAR(info.world.xy[5], 50 - (static_cast<double>(top) + 0.5) * cell, 1e-9);
    Cells cells;
    PointBlock block;
    while (source->next(block)) {
      for (const Point3& p : block.positions) {
        const auto c = static_cast<std::int64_t>(p[0]) + left;
        const auto r = static_cast<std::int64_t>(p[1]) + top;
        ASSERT_TRUE(cells.insert({{c, r}, p[2]}).second) << "twice: " << c << ", " << r;
      }
    }
    ASSERT_EQ(cells, expected);
    EXPECT_EQ(source->progress().points + source->progress().nodata, info.columns * info.rows);
  }
}

TiffSpec at(double x, double y, double cell = 10) {
  TiffSpec spec;
  spec.columns = spec.rows = 8;
  spec.more = placed_at(x, y, cell);
  return spec;
}

/// Expects an error that names both files.
void expect_misfit(const Files& files, const std::optional<Crs>& crs = std::nullopt) {
  try {
    open_mosaic(files.names(), plain_opener(), crs);
    ADD_FAILURE() << "fits";
  } catch (const Error& error) {
    for (const std::string& name : files.names()) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

/// A raster of 8 x 8 zeros that counts the open rasters of its class.
class CountedRaster final : public Raster {
 public:
  CountedRaster(const std::string& name, std::size_t& open) : open_(open) {
    info_.files = {name};
    info_.columns = info_.rows = 8;
    info_.sample.type = ScalarType::u8;
    info_.world.xy = {1, 0, 8 * std::stod(name), 0, -1, 0};
    info_.held_bytes = 1000;
    ++open_;
  }
  ~CountedRaster() override { --open_; }
  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  bool read_over(const CellWindow&, const CellBuffer&) override { return false; }

 private:
  std::size_t& open_;
  RasterInfo info_;
};

TEST(Mosaic, KeepsFilesOpenWithinItsMemory) {
  for (const std::size_t room : {0u, 1u, 2u, 5u, 40u}) {
    SCOPED_TRACE(room);
    std::size_t open = 0, max_open = 0;
    const RasterOpener opener = [&](const std::string& name) {
      auto raster = std::make_unique<CountedRaster>(name, open);
      max_open = std::max(max_open, open);
      return raster;
    };
    const auto mosaic = open_mosaic({"0", "1", "2", "3", "4", "5", "6", "7"}, opener, std::nullopt,
                                    32, 1000 * room + 999);
    EXPECT_EQ(mosaic->info().held_bytes, 1000u);
    std::vector<std::byte> samples(64 * 8);
    std::vector<std::uint8_t> valid(64 * 8);
    const CellBuffer out{.samples = samples.data(), .valid = valid.data(), .stride = 64};
    for (int round = 0; round < 3; ++round) {
      mosaic->read_over({.column = 0, .row = 0, .columns = 64, .rows = 8}, out);
    }
    EXPECT_EQ(max_open, std::clamp<std::size_t>(room, 1, 8));
  }
}

TEST(Mosaic, RefusesRastersThatDoNotMatch) {
  const std::vector<std::byte> samples(8 * 8 * 8);
  {
    Files files;  // shifted by a tenth of a cell
    files.add(at(0, 0), samples);
    files.add(at(81, 0), samples);
    expect_misfit(files);
  }
  {
    Files files;  // another cell size
    files.add(at(0, 0), samples);
    files.add(at(80, 0, 10.1), samples);
    expect_misfit(files);
  }
  {
    Files files;  // another type
    files.add(at(0, 0), samples);
    TiffSpec other = at(80, 0);
    other.type = ScalarType::f32;
    files.add(other, samples);
    expect_misfit(files);
  }
  {
    Files files;  // another scale
    files.add(at(0, 0), samples);
    TiffSpec other = at(80, 0);
    other.more = [](TIFF* tiff) {
      placed_at(80, 0, 10)(tiff);
      TIFFSetField(tiff, 42112, "<Item name=\"SCALE\" sample=\"0\" role=\"scale\">2</Item>");
    };
    files.add(other, samples);
    expect_misfit(files);
  }
  {
    Files files;  // too far away
    files.add(at(0, 0), samples);
    files.add(at(1.1e10, 0), samples);
    EXPECT_THROW(open_mosaic(files.names(), plain_opener()), Error);
  }
}

TEST(Mosaic, IgnoresShiftsOfAThousandthOfACell) {
  const std::vector<std::byte> samples(8 * 8 * 2);
  Files files;
  files.add(at(0, 0), samples);
  files.add(at(80.005, -0.005, 10.0005), samples);
  const std::unique_ptr<Raster> mosaic = open_mosaic(files.names(), plain_opener());
  EXPECT_EQ(mosaic->info().columns, 16u);
  EXPECT_TRUE(mosaic->info().notes.empty());
}

TEST(Mosaic, NotesShiftsOfAFewHundredthsOfACell) {
  const std::vector<std::byte> samples(8 * 8 * 2);
  Files files;
  files.add(at(0, 0), samples);
  files.add(at(80.03, -0.4), samples);
  const RasterInfo info = open_mosaic(files.names(), plain_opener())->info();
  EXPECT_EQ(info.columns, 16u);
  ASSERT_EQ(info.notes.size(), 1u);
  EXPECT_NE(info.notes[0].find("0.04 of a cell"), std::string::npos) << info.notes[0];
}

TEST(Mosaic, CrsMustAgreeUnlessTheCallerGivesIt) {
  const std::vector<std::byte> samples(8 * 8 * 2);
  Files files;
  for (const int epsg : {32632, 32633}) {
    TiffSpec spec = at(0, 0);
    spec.more = [=](TIFF* tiff) {
      placed_at(0, 0, 10)(tiff);
      const std::vector<std::uint16_t> keys{1, 1, 0,    2, 1024, 0,
                                            1, 1, 3072, 0, 1,    static_cast<std::uint16_t>(epsg)};
      TIFFSetField(tiff, 34735, static_cast<int>(keys.size()), keys.data());
    };
    files.add(spec, samples);
  }
  expect_misfit(files);
  EXPECT_NO_THROW(open_mosaic(files.names(), plain_opener(), Crs{}));
  SourceOptions options;
  EXPECT_THROW(geotiff_format().open(files.names(), options), Error);
  options.crs = Crs{};
  options.crs->epsg = 32632;
  EXPECT_EQ(geotiff_format().open(files.names(), options)->info().crs.epsg, 32632);
}

TEST(Mosaic, JoinsFilesOnBothSidesOfTheAntimeridian) {
  std::list<Files> all_files;
  const auto joined = [&all_files](const std::vector<double>& wests, bool degrees) {
    Files& files = all_files.emplace_back();
    for (const double west : wests) {
      TiffSpec spec = at(west, 20, 0.125);
      spec.more = [=](TIFF* tiff) {
        placed_at(west, 20, 0.125)(tiff);
        const std::vector<std::uint16_t> keys{1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 4326};
        TIFFSetField(tiff, 34735, static_cast<int>(keys.size()), keys.data());
      };
      files.add(spec, as_samples(std::vector<std::int16_t>(64, static_cast<std::int16_t>(west))));
    }
    Crs plane;
    plane.name = "plane";
    return open_mosaic(files.names(), plain_opener(),
                       degrees ? std::nullopt : std::optional(plane));
  };
  for (const std::vector<double>& wests : {std::vector<double>{179, -180}, {-180, 179}}) {
    const auto raster = joined(wests, true);
    EXPECT_EQ(raster->info().columns, 16u);
    EXPECT_EQ(raster->info().world.xy[2], 179.0625);
    const WholeRaster read = read_whole(*raster);
    EXPECT_EQ(read.value(7), 179);
    EXPECT_EQ(read.value(8), -180);
  }
  // Longitudes from 0 to 360 are cut at Greenwich instead, so files are joined there.
  EXPECT_EQ(joined({0, 359}, true)->info().world.xy[2], -0.9375);
  EXPECT_EQ(joined({-179, 100, 170}, true)->info().columns, 82u * 8);
  // Files all around the Earth, and files that are not in degrees, stay where they are.
  EXPECT_EQ(joined({-180, -90, 0, 90, 179}, true)->info().columns, 360u * 8);
  EXPECT_EQ(joined({-180, 179}, false)->info().columns, 360u * 8);
}

/// One real file given twice gives the same points as once.
TEST(Mosaic, OneRealFileTwiceEqualsThatFile) {
  const auto folder = real_data();
  if (!folder) GTEST_SKIP() << "needs TERRACE_DATA";
  const std::string file = (*folder / "dem/N46E008_alps_point.tif").string();
  const auto once = open_geotiff(file);
  const auto twice = open_mosaic({file, file}, plain_opener());
  const WholeRaster a = read_whole(*once), b = read_whole(*twice);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.valid, b.valid);
  EXPECT_EQ(a.info.world, b.info.world);
}

}  // namespace
}  // namespace terrace::stream
