// SPDX-License-Identifier: GPL-3.0-or-later
#include "synth/synth_dem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/ordered_work.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "terrace/stream/geotiff_writer.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr std::uint32_t kSynthTile = 256;

/// Sums over the steps between neighbouring cells, and the height range. Integer samples are summed
/// as doubles too: squares below 2^53 are exact.
struct Statistics {
  double squares = 0;
  std::uint64_t steps = 0;
  double minimum = std::numeric_limits<double>::infinity();
  double maximum = -std::numeric_limits<double>::infinity();

  void add(const Statistics& other) {
    squares += other.squares;
    steps += other.steps;
    minimum = std::min(minimum, other.minimum);
    maximum = std::max(maximum, other.maximum);
  }
  [[nodiscard]] double rms() const {
    return steps == 0 ? 0 : std::sqrt(squares / static_cast<double>(steps));
  }
};

/// Converts one row of heights to samples.
template <class Sample>
void to_samples(std::span<const float> heights, float base, Sample* samples) {
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if constexpr (std::is_same_v<Sample, float>) {
      samples[i] = base + heights[i];
    } else {
      // Round by truncating a positive number, which can be vectorised.
      const float shifted = base + heights[i] + 32768.5F;
      samples[i] = static_cast<Sample>(static_cast<std::int32_t>(shifted) - 32768);
    }
  }
}

/// Adds the steps and heights of a row to the statistics. `row_above` is null for the first row.
template <class Sample>
void measure(const Sample* row, const Sample* row_above, std::size_t width,
             Statistics& statistics) {
  // Use eight separate sums, so that the compiler can vectorise them in a fixed order.
  std::array<double, 8> sums{};
  Sample low = row[0], high = row[0];
  const auto square = [](Sample a, Sample b) {
    const double d = static_cast<double>(a) - static_cast<double>(b);
    return d * d;
  };
  for (std::size_t i = 0; i < width; ++i) {
    low = std::min(low, row[i]);
    high = std::max(high, row[i]);
    if (i + 1 < width) sums[i % 4] += square(row[i + 1], row[i]);
    if (row_above != nullptr) sums[4 + i % 4] += square(row[i], row_above[i]);
  }
  for (const double sum : sums) statistics.squares += sum;
  statistics.steps += width - 1 + (row_above != nullptr ? width : 0);
  statistics.minimum = std::min(statistics.minimum, static_cast<double>(low));
  statistics.maximum = std::max(statistics.maximum, static_cast<double>(high));
}

/// A piece of the raster: several adjacent tiles.
struct Piece {
  std::uint32_t first_column, first_row, columns, rows;  ///< without cells beyond the raster
  std::uint32_t tiles;
};

/// Generates the pieces of a DEM in parallel and writes them in order.
template <class Sample>
class DemWriter {
 public:
  DemWriter(const std::string& path, const SynthDemOptions& options, const Fractal& fractal,
            float base, const std::function<void(std::uint64_t)>& progress)
      : options_(options),
        fractal_(fractal),
        base_(base),
        progress_(progress),
        columns_(static_cast<std::uint32_t>(options.size.width)),
        rows_(static_cast<std::uint32_t>(options.size.height)),
        writer_(path, checked(writer_options(options), options.memory_bytes)) {
    // Each thread holds a piece of samples, and some rows of lattices with about 48 bytes per
    // column. Two more pieces per thread wait until they are written.
    const std::uint64_t per_column = 3 * kSynthTile * sizeof(Sample) + 48;
    constexpr std::uint64_t kOverhead = 48u << 20;
    const std::uint64_t share =
        (std::max(options.memory_bytes, 2 * kOverhead) - kOverhead) / options.threads;
    piece_columns_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
        share / per_column / kSynthTile * kSynthTile, kSynthTile, 1u << 16));
    pieces_across_ = (columns_ + piece_columns_ - 1) / piece_columns_;
    pieces_ = std::uint64_t{pieces_across_} * ((rows_ + kSynthTile - 1) / kSynthTile);
  }

  /// Writes the file. Returns the statistics of its samples.
  Statistics run() {
    Statistics total;
    std::uint64_t cells = 0;
    base::in_order(
        pieces_, options_.threads, [this](unsigned, std::size_t i) { return generate(piece(i)); },
        [&](std::size_t i, const PieceSamples& result) {
          check_interrupt();
          const Piece p = piece(i);
          write(p, result.tiles);
          total.add(result.statistics);
          cells += std::uint64_t{p.columns} * p.rows;
          progress_(cells);
        });
    writer_.commit();
    return total;
  }

 private:
  struct PieceSamples {
    std::vector<Sample> tiles;
    Statistics statistics;
  };

  /// Returns `tiff`. Throws std::runtime_error if the file's tile table does not fit into memory.
  static stream::GeoTiffOptions checked(stream::GeoTiffOptions tiff, std::uint64_t memory_bytes) {
    const std::uint64_t table = stream::geotiff_table_bytes(tiff);
    if (table <= memory_bytes / 4) return tiff;
    throw std::runtime_error(
        fmt::format("a raster of {} x {} cells needs {} of memory, --memory allows {}; give a "
                    "smaller --size or more --memory",
                    with_commas(tiff.columns), with_commas(tiff.rows), readable_bytes(4 * table),
                    readable_bytes(memory_bytes)));
  }

  static stream::GeoTiffOptions writer_options(const SynthDemOptions& options) {
    stream::GeoTiffOptions tiff;
    tiff.columns = static_cast<std::uint32_t>(options.size.width);
    tiff.rows = static_cast<std::uint32_t>(options.size.height);
    tiff.sample.name = "height";
    tiff.sample.type =
        std::is_same_v<Sample, float> ? stream::ScalarType::f32 : stream::ScalarType::i16;
    // The corner is in the Alps, in UTM zone 32 or in degrees.
    const double x = options.crs.geographic ? 8.0 : 400000.0;
    const double y = options.crs.geographic ? 47.0 : 5200000.0;
    const double c = options.cell;
    tiff.world.xy = {c, 0, x + 0.5 * c, 0, -c, y - 0.5 * c};
    tiff.crs = options.crs;
    tiff.compression = options.compression == "deflate" ? stream::GeoTiffCompression::deflate
                       : options.compression == "zstd"  ? stream::GeoTiffCompression::zstd
                                                        : stream::GeoTiffCompression::none;
    tiff.tile = kSynthTile;
    tiff.replace = options.replace;
    return tiff;
  }

  [[nodiscard]] Piece piece(std::uint64_t number) const {
    Piece p{};
    p.first_column = static_cast<std::uint32_t>(number % pieces_across_) * piece_columns_;
    p.first_row = static_cast<std::uint32_t>(number / pieces_across_) * kSynthTile;
    p.columns = std::min(piece_columns_, columns_ - p.first_column);
    p.rows = std::min(kSynthTile, rows_ - p.first_row);
    p.tiles = (p.columns + kSynthTile - 1) / kSynthTile;
    return p;
  }

  PieceSamples generate(const Piece& p) const {
    constexpr std::size_t kTileSize = std::size_t{kSynthTile} * kSynthTile;
    PieceSamples result{std::vector<Sample>(p.tiles * kTileSize), {}};
    std::vector<Sample> row(p.columns), above(p.columns);
    Fractal::Rows rows(fractal_, p.first_column, p.columns);
    for (std::uint32_t y = 0; y < p.rows; ++y) {
      to_samples(rows.row(p.first_row + y), base_, row.data());
      measure(row.data(), y == 0 ? nullptr : above.data(), p.columns, result.statistics);
      for (std::uint32_t t = 0; t < p.tiles; ++t) {
        const std::uint32_t width = std::min(kSynthTile, p.columns - t * kSynthTile);
        std::memcpy(result.tiles.data() + t * kTileSize + std::size_t{y} * kSynthTile,
                    row.data() + t * kSynthTile, width * sizeof(Sample));
      }
      row.swap(above);
    }
    return result;
  }

  void write(const Piece& p, const std::vector<Sample>& tiles) {
    constexpr std::size_t kTileSize = std::size_t{kSynthTile} * kSynthTile;
    const std::span<const Sample> samples(tiles);
    for (std::uint32_t t = 0; t < p.tiles; ++t) {
      writer_.write_tile(p.first_column / kSynthTile + t, p.first_row / kSynthTile,
                         std::as_bytes(samples.subspan(t * kTileSize, kTileSize)));
    }
  }

  const SynthDemOptions& options_;
  const Fractal& fractal_;
  float base_;
  const std::function<void(std::uint64_t)>& progress_;
  std::uint32_t columns_, rows_;
  stream::GeoTiffWriter writer_;
  std::uint32_t piece_columns_ = kSynthTile, pieces_across_ = 1;
  std::uint64_t pieces_ = 0;
};

/// Returns the RMS step between neighbouring cells of a whole raster, before rounding.
double measured_step(const Fractal& fractal, const ImageSize& size) {
  const auto width = static_cast<std::uint32_t>(size.width);
  Fractal::Rows rows(fractal, 0, width);
  std::vector<float> above(width);
  Statistics statistics;
  for (std::uint32_t y = 0; y < size.height; ++y) {
    const std::span<const float> row = rows.row(y);
    measure(row.data(), y == 0 ? nullptr : above.data(), width, statistics);
    std::copy(row.begin(), row.end(), above.begin());
  }
  return statistics.rms();
}

}  // namespace

SynthDemResult write_synth_dem(const std::string& path, const SynthDemOptions& options,
                               const std::function<void(std::uint64_t)>& progress) {
  FractalOptions fractal_options{.seed = options.seed,
                                 .hurst = options.hurst,
                                 .rms_step = options.roughness,
                                 .rounded = !options.floats};
  Fractal fractal(fractal_options);
  constexpr std::uint64_t kSmall = 1u << 22;
  if (options.size.width * options.size.height <= kSmall) {
    const double step = measured_step(fractal, options.size);
    if (step > 0) fractal.scale(fractal.rms_step() / step);
  }

  constexpr double kLargest = 32767;
  const double four_deviations = std::ceil(4 * fractal.standard_deviation());
  const double base = options.floats
                          ? four_deviations
                          : std::min(four_deviations, std::floor(kLargest - fractal.bound()));
  if (!options.floats && fractal.bound() > kLargest) {
    throw UsageError("heights of this roughness may not fit int16; give --type float32");
  }
  const Statistics statistics =
      options.floats
          ? DemWriter<float>(path, options, fractal, static_cast<float>(base), progress).run()
          : DemWriter<std::int16_t>(path, options, fractal, static_cast<float>(base), progress)
                .run();
  std::error_code ignored;
  return {.bytes = std::filesystem::file_size(path, ignored),
          .base = base,
          .minimum = statistics.minimum,
          .maximum = statistics.maximum,
          .rms_step = statistics.rms()};
}

}  // namespace terrace::tools
