// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/overviews.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "with_type.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint32_t kSmallEnough = 512;

template <class T>
void fill(std::vector<std::byte>& samples, std::size_t bytes, T value) {
  samples.resize(bytes);
  for (std::size_t at = 0; at < bytes; at += sizeof value) {
    std::memcpy(samples.data() + at, &value, sizeof value);
  }
}

/// Returns the nodata value as a sample; nullopt if no sample can have it.
template <class T>
std::optional<T> sample_of(const std::optional<double>& nodata) {
  if (!nodata) return std::nullopt;
  if constexpr (std::is_integral_v<T>) {
    // 2^63 and 2^64 are doubles, but the largest integers below them are not.
    constexpr double kEnd = 2.0 * static_cast<double>(std::numeric_limits<T>::max() / 2 + 1);
    const bool fits = *nodata >= static_cast<double>(std::numeric_limits<T>::min()) &&
                      *nodata < kEnd && std::trunc(*nodata) == *nodata;
    if (!fits) return std::nullopt;
  }
  return static_cast<T>(*nodata);
}

/// Returns the mean of up to four samples, rounded; the first of them if the mean is the nodata
/// value.
template <class T>
T average(std::span<const T> values, const std::optional<T>& nodata) {
  double sum = 0;
  for (const T value : values) sum += static_cast<double>(value);
  const double mean = sum / static_cast<double>(values.size());
  T result;
  if constexpr (std::is_integral_v<T>) {
    const auto range = std::minmax_element(values.begin(), values.end());
    // Beyond 2^53 rounding may take the mean out of the samples' range.
    const double rounded = std::floor(mean + 0.5);
    result = rounded >= static_cast<double>(*range.second)  ? *range.second
             : rounded <= static_cast<double>(*range.first) ? *range.first
                                                            : static_cast<T>(rounded);
  } else {
    result = static_cast<T>(mean);
  }
  return nodata && result == *nodata ? values.front() : result;
}

}  // namespace

std::vector<GeoTiffLevel> levels_of(const GeoTiffOptions& options) {
  std::vector<GeoTiffLevel> levels;
  const auto halved = [](std::uint32_t length) { return length / 2 + length % 2; };
  for (std::uint32_t columns = options.columns, rows = options.rows;;
       columns = halved(columns), rows = halved(rows)) {
    const auto tiles = [&](std::uint32_t length) {
      return static_cast<std::uint32_t>((std::uint64_t{length} + options.tile - 1) / options.tile);
    };
    levels.push_back(
        {.columns = columns, .rows = rows, .across = tiles(columns), .down = tiles(rows)});
    if (options.overviews == GeoTiffOverviews::none ||
        (columns <= kSmallEnough && rows <= kSmallEnough)) {
      return levels;
    }
  }
}

Overviews::Overviews(const GeoTiffOptions& options, std::vector<GeoTiffLevel> levels, Write write)
    : options_(options),
      levels_(std::move(levels)),
      write_(std::move(write)),
      open_(levels_.size()) {}

void Overviews::add(std::size_t level, std::uint32_t across, std::uint32_t down,
                    std::span<const std::byte> samples) {
  if (level + 1 == levels_.size()) return;
  const TilePosition position{across / 2, down / 2};
  Tile& parent = open_[level + 1][position];
  if (!samples.empty()) {
    with_type(options_.sample.type, [&](auto sample) {
      reduce<decltype(sample)>(level, across, down, samples, parent.samples);
    });
  }
  const GeoTiffLevel& current_level = levels_[level];
  const auto children = std::min(2u, current_level.across - 2 * position.first) *
                        std::min(2u, current_level.down - 2 * position.second);
  if (++parent.children < children) return;
  auto complete_tile = open_[level + 1].extract(position);
  complete(level + 1, position, std::move(complete_tile.mapped()));
}

void Overviews::complete(std::size_t level, TilePosition position, Tile tile) {
  add(level, position.first, position.second, tile.samples);
  if (!tile.samples.empty()) write_(level, position.first, position.second, tile.samples);
}

void Overviews::finish() {
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    while (!open_[level].empty()) {
      auto first = open_[level].extract(open_[level].begin());
      complete(level, first.key(), std::move(first.mapped()));
    }
  }
}

/// Writes a tile, at half its resolution, to its quarter of the parent.
template <class T>
void Overviews::reduce(std::size_t level, std::uint32_t across, std::uint32_t down,
                       std::span<const std::byte> samples, std::vector<std::byte>& parent) const {
  const std::size_t side = options_.tile;
  const std::optional<T> nodata = sample_of<T>(options_.nodata);
  // Readers interpret missing cells as nodata, or as 0 without a nodata value.
  const T missing = nodata.value_or(T{});
  if (parent.empty()) fill(parent, side * side * sizeof(T), missing);
  const GeoTiffLevel& current_level = levels_[level];
  const std::size_t columns = std::min<std::size_t>(side, current_level.columns - across * side);
  const std::size_t rows = std::min<std::size_t>(side, current_level.rows - down * side);
  std::byte* const quarter =
      parent.data() + ((down % 2) * side + across % 2) * (side / 2) * sizeof(T);
  for (std::size_t row = 0; row < rows; row += 2) {
    for (std::size_t column = 0; column < columns; column += 2) {
      std::array<T, 4> values{};
      std::size_t valid = 0;
      for (std::size_t r = row; r < std::min(row + 2, rows); ++r) {
        for (std::size_t c = column; c < std::min(column + 2, columns); ++c) {
          T& value = values[valid];
          std::memcpy(&value, samples.data() + (r * side + c) * sizeof(T), sizeof(T));
          if (value == value && !(nodata && value == *nodata)) ++valid;
        }
      }
      if (valid == 0 && nodata) continue;
      const std::span<const T> present = std::span(values).first(std::max<std::size_t>(valid, 1));
      const T result = options_.overviews == GeoTiffOverviews::average ? average(present, nodata)
                                                                       : present.front();
      std::memcpy(quarter + (row / 2 * side + column / 2) * sizeof(T), &result, sizeof(T));
    }
  }
}

}  // namespace terrace::stream
