// SPDX-License-Identifier: GPL-3.0-or-later
// The cost of queries on the store that TERRACE_BENCH_STORE names, or else on one made here from a
// fractal elevation model of 2049 x 2049 samples.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>
#include <terrace/stream/byte_source.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/cli.hpp"
#include "cli/option_values.hpp"
#include "sample/place_file.hpp"
#include "sample/sample_run.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/raster.hpp"

namespace {

using terrace::stream::Store;

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

const Store& store() {
  static const terrace::tests::TemporaryFolder folder;
  static const Store opened = [] {
    if (const char* given = std::getenv("TERRACE_BENCH_STORE")) return Store::open(given);
    const std::string dem = (folder.path() / "dem.tif").string();
    const std::array<const char*, 7> synth{
        "terrace", "synth", "dem", "--size", small() ? "257x257" : "2049x2049", "-o", dem.c_str()};
    if (terrace::tools::run_command_line(static_cast<int>(synth.size()), synth.data()) != 0)
      std::exit(1);
    terrace::terrain::BuildRequest request;
    request.inputs = {dem};
    request.store = folder.path() / "dem.store";
    terrace::terrain::build_store(request, {.threads = 2});
    return Store::open(request.store);
  }();
  return opened;
}

/// All samples as floats, window by window; the argument is the side of a window.
void windows(benchmark::State& state) {
  const Store& source = store();  // make the store before the clock starts
  const auto side = state.range(0);
  const auto columns = static_cast<std::int64_t>(source.schema().columns);
  const auto rows = static_cast<std::int64_t>(source.schema().rows);
  std::vector<float> heights(static_cast<std::size_t>(side * side));
  for (auto _ : state) {
    terrace::terrain::StoreWindow reader(source);
    for (std::int64_t row = 0; row < rows; row += side) {
      for (std::int64_t column = 0; column < columns; column += side) {
        reader.heights({column, row, side, side}, std::span(heights));
        benchmark::DoNotOptimize(heights.data());
      }
    }
  }
  state.SetItemsProcessed(state.iterations() * columns * rows);
}
BENCHMARK(windows)->Arg(128)->Arg(512)->Unit(benchmark::kMillisecond);

/// The same window repeatedly, served from the cache.
void same_window(benchmark::State& state) {
  const Store& source = store();
  const auto side = state.range(0);
  std::vector<float> heights(static_cast<std::size_t>(side * side));
  terrace::terrain::StoreWindow reader(source, std::uint64_t{16} << 20);
  for (auto _ : state) {
    reader.heights({10, 10, side, side}, std::span(heights));
    benchmark::DoNotOptimize(heights.data());
  }
  state.SetItemsProcessed(state.iterations() * side * side);
}
BENCHMARK(same_window)->Arg(64)->Arg(256)->Unit(benchmark::kMillisecond);

std::size_t place_count() { return small() ? 2000 : 1000000; }

/// Random columns and rows on the lattice.
std::vector<terrace::terrain::Point2> random_places() {
  const auto columns = static_cast<double>(store().schema().columns - 1);
  const auto rows = static_cast<double>(store().schema().rows - 1);
  std::vector<terrace::terrain::Point2> places(place_count());
  std::uint64_t seed = 1;
  const auto next = [&seed] {
    seed = terrace::base::splitmix64(seed);
    return terrace::base::unit_interval(seed);
  };
  for (terrace::terrain::Point2& place : places) place = {next() * columns, next() * rows};
  return places;
}

/// Heights and gradients at a million places in one call on one thread; the argument is the method.
void sample(benchmark::State& state) {
  const std::array<const char*, 3> methods{"linear", "natural", "nearest"};
  const char* const method = methods[static_cast<std::size_t>(state.range(0))];
  state.SetLabel(method);
  terrace::terrain::SamplerOptions options;
  options.method = terrace::tools::parse_interpolation(method);
  const Store& source = store();
  const auto places = random_places();
  std::vector<terrace::terrain::SurfacePoint> surface(places.size());
  for (auto _ : state) {
    terrace::terrain::make_sampler(source, options)->sample(places, surface);
    benchmark::DoNotOptimize(surface.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
BENCHMARK(sample)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

/// The same with linear interpolation, as the command does it: reads, answers and writes lines of
/// CSV.
void sample_lines(benchmark::State& state) {
  const Store& source = store();
  static const terrace::tests::TemporaryFolder folder;
  const std::string name = (folder.path() / "places.csv").string();
  const terrace::stream::Placement placement = source.schema();
  std::ofstream file(name);
  file.precision(12);
  for (const auto& [column, row] : random_places()) {
    const terrace::stream::Point3 p = terrace::stream::world_point(placement, {column, row, 0});
    file << p[0] << ',' << p[1] << '\n';
  }
  file.close();
  std::size_t bytes = 0;
  for (auto _ : state) {
    terrace::terrain::PlaceFile places(name);
    terrace::terrain::answer_places(source, {}, places, {},
                                    [&bytes](std::string_view text) { bytes += text.size(); }, {});
  }
  benchmark::DoNotOptimize(bytes);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(place_count()));
}
BENCHMARK(sample_lines)->Unit(benchmark::kMillisecond);

/// A random square within the bounds that covers this share of their area, in the store's CRS.
terrace::terrain::Region random_square(double share, std::uint64_t seed) {
  const terrace::stream::Box3 all = terrace::stream::world_box(store().schema(), store().bounds());
  std::string text[2];
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double side = std::sqrt(share) * (all.max[axis] - all.min[axis]);
    seed = terrace::base::splitmix64(seed);
    const double low =
        all.min[axis] + terrace::base::unit_interval(seed) * (all.max[axis] - all.min[axis] - side);
    text[0] += std::to_string(low) + ',';
    text[1] += std::to_string(low + side) + (axis == 0 ? "," : "");
  }
  return terrace::terrain::Region::parse(text[0] + text[1]);
}

/// The folder of a store; counts the bytes read.
terrace::stream::OpenByName counting(const std::filesystem::path& folder, std::uint64_t& bytes) {
  return [folder, &bytes](const std::string& name) {
    const std::shared_ptr<terrace::stream::ByteSource> file =
        terrace::stream::open_file(folder / name);
    return terrace::stream::bytes_by_function(
        name, file->size(), [file, &bytes](std::uint64_t offset, std::span<std::byte> out) {
          file->read(offset, out);
          bytes += out.size();
        });
  };
}

/// Reads all points inside a square from a store that has just been opened. The argument is the
/// square's share of the area, in ten-thousandths. The counters are means over the squares. Per
/// point inside, `delivered` counts the points that a caller gets, `decoded` the points of the
/// clusters read, `least` the points of the clusters that have points inside, and `bytes` the bytes
/// of clusters. `read` is the number of bytes read, index included, per byte of clusters that have
/// points inside. The root, which can be as large as a block, is excluded, because frequent readers
/// keep it in memory.
void region(benchmark::State& state) {
  const Store& source = store();
  const terrace::stream::Placement placement = source.schema();
  const double share = static_cast<double>(state.range(0)) / 10000;
  const std::uint64_t squares = small() ? 2 : share < 0.005 ? 200 : share < 0.05 ? 40 : 10;
  std::uint64_t inside = 0, delivered = 0, decoded = 0, clusters = 0, bytes = 0, reads = 0;
  std::uint64_t read = 0, needed = 0, least = 0;
  for (auto _ : state) {
    for (std::uint64_t square = 1; square <= squares; ++square) {
      state.PauseTiming();
      terrace::terrain::Detail detail;
      detail.region = random_square(share, square);
      std::uint64_t counted = 0;
      const Store fresh = Store::open("store", counting(source.path(), counted));
      static_cast<void>(fresh.record(fresh.root()));
      counted = 0;
      state.ResumeTiming();
      terrace::terrain::for_each_wanted(
          fresh, detail,
          [&](terrace::stream::ClusterId id, const terrace::stream::ClusterRecord& record,
              const terrace::stream::ClusterPoints& points) {
            std::uint64_t within = 0;
            for (const auto& p : points.positions) {
              within += detail.region->contains(terrace::stream::world_point(placement, p));
            }
            inside += within;
            if (id == fresh.root()) return;
            ++clusters;
            bytes += record.bytes;
            decoded += points.size();
            if (within == 0) return;
            needed += record.bytes;
            least += points.size();
          });
      read += counted - fresh.record(fresh.root()).bytes;
      ++reads;
      state.PauseTiming();
      terrace::terrain::for_each_wanted_point(fresh, detail, [&](auto&&...) { ++delivered; });
      state.ResumeTiming();
    }
  }
  const auto count = static_cast<double>(reads);
  const auto within = static_cast<double>(std::max<std::uint64_t>(1, inside));
  state.counters["inside"] = static_cast<double>(inside) / count;
  state.counters["clusters"] = static_cast<double>(clusters) / count;
  state.counters["KB"] = static_cast<double>(bytes) / count / 1000;
  state.counters["delivered"] = static_cast<double>(delivered) / within;
  state.counters["decoded"] = static_cast<double>(decoded) / within;
  state.counters["least"] = static_cast<double>(least) / within;
  state.counters["bytes"] = static_cast<double>(bytes) / within;
  state.counters["read"] =
      static_cast<double>(read) / static_cast<double>(std::max<std::uint64_t>(1, needed));
  state.SetItemsProcessed(static_cast<std::int64_t>(inside));
}
BENCHMARK(region)->Arg(1)->Arg(6)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

/// An outline of 100,000 vertices around most of the store, jagged at every scale like a coast.
terrace::terrain::Region coast() {
  const terrace::stream::Box3 all = terrace::stream::world_box(store().schema(), store().bounds());
  const std::size_t corners = small() ? 2000 : 100000;
  std::vector<terrace::terrain::Point2> ring(corners);
  for (std::size_t i = 0; i < corners; ++i) {
    const double turn = static_cast<double>(i) / static_cast<double>(corners);
    double radius = 0.9;
    for (int octave = 2; octave < 15; ++octave) {
      const double waves = std::ldexp(1.0, octave);
      const auto height = [&](double wave) {
        return terrace::base::unit_interval(
            terrace::base::splitmix64(static_cast<std::uint64_t>(std::fmod(wave, waves) + waves)));
      };
      const double wave = std::floor(turn * waves), t = turn * waves - wave;
      radius -= 0.3 / waves * ((1 - t) * height(wave) + t * height(wave + 1));
    }
    const std::array<double, 2> direction{terrace::base::cos_degrees(360 * turn),
                                          terrace::base::sin_degrees(360 * turn)};
    // Between a circle and a square, so that it fills the store.
    const double reach = radius / std::max(std::abs(direction[0]), std::abs(direction[1]));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      ring[i][axis] = 0.5 * (all.min[axis] + all.max[axis]) +
                      0.5 * (all.max[axis] - all.min[axis]) * reach * direction[axis];
    }
  }
  return terrace::terrain::Region::of_polygons({{std::move(ring)}}, all.min[2], all.max[2]);
}

/// 0: the box of the polygon, which contains more; 1: the polygon. Shows what a polygon costs in
/// addition.
terrace::terrain::Region region_of(const benchmark::State& state) {
  const terrace::terrain::Region polygon = coast();
  return state.range(0) == 0 ? terrace::terrain::Region::of_box(polygon.box()) : polygon;
}

void prepare_polygon(benchmark::State& state) {
  store();
  for (auto _ : state) benchmark::DoNotOptimize(coast());
}
BENCHMARK(prepare_polygon)->Unit(benchmark::kMillisecond);

/// All points inside, written as by the command.
void polygon_points(benchmark::State& state) {
  const Store& source = store();
  terrace::terrain::Detail detail;
  detail.region = region_of(state);
  std::size_t inside = 0;
  for (auto _ : state) inside = terrace::terrain::detail_points(source, detail).positions.size();
  state.counters["inside"] = static_cast<double>(inside);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(inside));
}
BENCHMARK(polygon_points)->DenseRange(0, 1)->Unit(benchmark::kMillisecond);

/// The raster's own lattice inside, written as GeoTIFF.
void polygon_raster(benchmark::State& state) {
  static const terrace::tests::TemporaryFolder folder;
  const Store& source = store();
  terrace::terrain::RasterRequest request;
  request.region = region_of(state);
  request.output = (folder.path() / "out.tif").string();
  request.replace = true;
  std::uint64_t cells = 0;
  for (auto _ : state) {
    cells = terrace::terrain::write_raster(source, request, {.threads = 2}).cells_with_data;
  }
  state.counters["inside"] = static_cast<double>(cells);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cells));
}
BENCHMARK(polygon_raster)->DenseRange(0, 1)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
