// SPDX-License-Identifier: Apache-2.0
#include "format/grid/hgt.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "format/formats.hpp"
#include "format/grid/plain_grid.hpp"
#include "format/grid/unpack.hpp"
#include "format/raster_points.hpp"
#include "io/bytes.hpp"
#include "io/text.hpp"

namespace terrace::stream {
namespace {

constexpr std::string_view kEnding = ".hgt";

/// The south-west corner, in degrees.
struct Corner {
  int longitude = 0, latitude = 0;
};

/// The corner in a file name that begins with "N46E008" or the like, in any case.
std::optional<Corner> corner_of(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  if (name.size() < 7) return std::nullopt;
  const auto upper = [&](std::size_t i) {
    return name[i] >= 'a' && name[i] <= 'z' ? static_cast<char>(name[i] - 32) : name[i];
  };
  const auto number = [&](std::size_t begin, std::size_t end) {
    int value = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (name[i] < '0' || name[i] > '9') return 1000;
      value = value * 10 + (name[i] - '0');
    }
    return value;
  };
  const char north = upper(0), east = upper(3);
  const int latitude = number(1, 3), longitude = number(4, 7);
  const bool longer = name.size() > 7 && name[7] >= '0' && name[7] <= '9';
  if ((north != 'N' && north != 'S') || (east != 'E' && east != 'W') || latitude > 90 ||
      longitude > 180 || longer) {
    return std::nullopt;
  }
  return Corner{.longitude = east == 'E' ? longitude : -longitude,
                .latitude = north == 'N' ? latitude : -latitude};
}

/// Columns and rows of a tile with that many bytes: a square, except in the far north and south,
/// where tiles have half the columns.
std::pair<std::uint64_t, std::uint64_t> size_of_tile(const std::string& file, std::uint64_t bytes) {
  constexpr std::uint64_t kHalfColumns = 1801, kFullRows = 3601;
  if (bytes == 2 * kHalfColumns * kFullRows) return {kHalfColumns, kFullRows};
  const auto side =
      static_cast<std::uint64_t>(std::lround(std::sqrt(static_cast<double>(bytes) / 2)));
  if (side < 2 || side > (1u << 20) || bytes != 2 * side * side) {
    throw grid_fault(file,
                     "has " + counted(bytes, "byte") + ", which is not a square of 16-bit samples")
        .remedy("the file is truncated or not an SRTM tile: download it again");
  }
  return {side, side};
}

/// packed_name: the tile's name in its archive. If it does not give the place, the name of the file
/// must.
PlainGrid describe_tile(const std::string& file, const std::string& packed_name,
                        std::uint64_t bytes) {
  std::optional<Corner> corner = corner_of(packed_name);
  if (!corner) corner = corner_of(file);
  if (!corner) {
    throw grid_fault(file, "its name does not show its place")
        .at(packed_name)
        .remedy("rename it after its south-west corner, such as N46E008.hgt");
  }
  const auto [columns, rows] = size_of_tile(file, bytes);
  PlainGrid grid = plain_grid("hgt", file, columns, rows, ScalarType::i16, "-32768");
  grid.order = std::endian::big;
  // Samples are on the lines of the grid: the outer ones are shared with the neighbours.
  grid.info.world.xy = {
      1 / static_cast<double>(columns - 1),   0,
      static_cast<double>(corner->longitude), 0,
      -1 / static_cast<double>(rows - 1),     static_cast<double>(corner->latitude + 1)};
  grid.info.sample.unit = "metre";
  grid.info.crs.epsg = 4326;
  grid.info.crs.vertical_epsg = 5773;  // EGM96
  grid.info.crs.name = "WGS 84";
  grid.info.crs.geographic = true;
  grid.info.crs.horizontal_unit = "degree";
  grid.info.crs.vertical_unit = "metre";
  return grid;
}

enum class Packing { none, zip, gzip };

Packing packing_of(const ByteSource& bytes) {
  std::array<std::byte, 4> head{};
  if (bytes.size() < head.size()) return Packing::none;
  bytes.read(0, head);
  // No tile begins like this: these bytes would be heights above 8 km.
  if (std::memcmp(head.data(), "PK\3\4", 4) == 0) return Packing::zip;
  if (std::memcmp(head.data(), "\x1f\x8b\x08", 3) == 0) return Packing::gzip;
  return Packing::none;
}

/// True for a zip archive whose first file, apart from small ones and folders, is a tile.
bool recognise_hgt(std::span<const std::byte> head) {
  // Offsets in the header of a packed file.
  constexpr std::size_t kPackedBytes = 18, kNameLength = 26, kExtraLength = 28, kName = 30;
  while (head.size() >= kName && std::memcmp(head.data(), "PK\3\4", 4) == 0) {
    const char* const header = reinterpret_cast<const char*>(head.data());
    const std::size_t length = load_little_endian<std::uint16_t>(header + kNameLength);
    if (length > head.size() - kName) return false;
    if (lower_case(std::string(header + kName, length)).ends_with(kEnding)) return true;
    // A file that states its size after its bytes ends the search: no header is found after it.
    const std::uint64_t next = std::uint64_t{kName} + length +
                               load_little_endian<std::uint16_t>(header + kExtraLength) +
                               load_little_endian<std::uint32_t>(header + kPackedBytes);
    head = head.subspan(static_cast<std::size_t>(std::min<std::uint64_t>(next, head.size())));
  }
  return false;
}

PlainGrid describe_packed_tile(const std::string& file, const PackedFile& packed,
                               const std::optional<std::string>& nodata) {
  constexpr std::uint64_t kUnpacking = 1u << 20;
  PlainGrid grid = describe_tile(file, packed.name, packed.size);
  if (nodata) set_nodata(*nodata, grid);
  grid.info.held_bytes = kUnpacking;
  return grid;
}

/// Opens the only tile of a zip archive, or all of them as a mosaic.
std::unique_ptr<Raster> open_archive(const std::string& file, const RasterOptions& options) {
  const auto archive = std::make_shared<const ZipArchive>(file);
  const std::vector<PackedFile> tiles = archive->find(kEnding);
  const auto open_tile = [file, archive, nodata = options.nodata](const PackedFile& tile) {
    return open_packed_grid(describe_packed_tile(file, tile, nodata),
                            [archive, tile] { return archive->unpack(tile); });
  };
  if (tiles.size() == 1) return open_tile(tiles.front());
  std::vector<std::string> names;
  std::unordered_map<std::string, PackedFile> by_name;
  for (const PackedFile& tile : tiles) {
    names.push_back(file + "/" + tile.name);
    by_name.emplace(names.back(), tile);
  }
  constexpr std::size_t kOpenAtOnce = 8;
  return open_mosaic(
      names,
      [by_name = std::move(by_name), open_tile](const std::string& name) {
        return open_tile(by_name.at(name));
      },
      std::nullopt, kOpenAtOnce, options.memory_bytes);
}

std::unique_ptr<PointSource> open_hgt_points(std::span<const std::string> files,
                                             const SourceOptions& options) {
  return open_raster_points(files, options, &open_hgt);
}

}  // namespace

std::unique_ptr<Raster> open_hgt(const std::string& file, const RasterOptions& options) {
  check_band(file, options.band, 1);
  std::unique_ptr<ByteSource> bytes = open_file(file);
  switch (packing_of(*bytes)) {
    case Packing::zip:
      return open_archive(file, options);
    case Packing::gzip: {
      const PackedFile packed = find_in_gzip(file);
      return open_packed_grid(describe_packed_tile(file, packed, options.nodata),
                              [file, packed] { return unpack_gzip(file, packed); });
    }
    case Packing::none:
      break;
  }
  PlainGrid grid = describe_tile(file, {}, bytes->size());
  if (options.nodata) set_nodata(*options.nodata, grid);
  return open_plain_grid(std::move(grid), std::move(bytes));
}

const Format& hgt_format() {
  static const Format format{.name = "hgt",
                             .endings = {".hgt", ".hgt.zip", ".hgt.gz"},
                             .recognise = &recognise_hgt,
                             .open = &open_hgt_points,
                             .raster = true};
  return format;
}

}  // namespace terrace::stream
