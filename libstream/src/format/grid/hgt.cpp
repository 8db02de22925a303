// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <zip.h>
#include <zlib.h>

#include "format/grid/plain.hpp"
#include "format/grid/rasters.hpp"
#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "io/bytes.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"
#include "terrace/stream/byte_source.hpp"

namespace terrace::stream {
namespace {

/// A file in an archive.
struct PackedFile {
  std::string name{};        ///< in the archive; empty if that has no names
  std::uint64_t size = 0;    ///< unpacked, as the archive states
  std::uint64_t number = 0;  ///< among a zip archive's files
};

/// An open zip archive.
class ZipArchive {
 public:
  /// Throws: Error if the file is not a zip archive.
  explicit ZipArchive(const std::string& file);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  /// Returns the files with that ending, in lower or upper case, in the order of the archive.
  /// Throws: Error if there is none, or if one states more bytes than its packed bytes could ever
  /// unpack to.
  [[nodiscard]] std::vector<PackedFile> find(std::string_view ending) const;
  /// Unpacks a file to a temporary file. Throws: Error if it is damaged or encrypted, or if it does
  /// not have its stated size.
  [[nodiscard]] std::unique_ptr<ByteSource> unpack(const PackedFile& packed) const;

 private:
  std::string file_;
  zip* archive_ = nullptr;
};

constexpr std::size_t kUnpackBytes = 256u << 10;
/// Throws: Error beyond the growth of Deflate. Other methods of zip archives compress flat ground
/// even better, but no elevation grid needs that.
void check_growth(const std::string& file, const std::string& where, std::uint64_t packed,
                  std::uint64_t unpacked) {
  if (unpacked / kDeflateGrowth <= packed) return;
  throw grid_fault(file, fmt::format("states {}, too many for {}", counted(unpacked, "byte"),
                                     counted(packed, "packed byte")))
      .at(where);
}

/// Collects unpacked bytes, never more than stated.
class Unpacked {
 public:
  Unpacked(const std::string& file, const PackedFile& packed)
      : file_(file), packed_(packed), spool_(std::make_unique<Spool>(file)) {}

  void append(std::span<const std::byte> bytes) {
    if (bytes.size() > packed_.size - spool_->size()) throw differs("more");
    spool_->append(bytes);
  }
  std::unique_ptr<ByteSource> take() {
    if (spool_->size() != packed_.size) throw differs("fewer");
    return std::move(spool_);
  }

 private:
  [[nodiscard]] Error differs(const char* relation) const {
    return grid_fault(file_, fmt::format("unpacks to {} than the {} that it states", relation,
                                         counted(packed_.size, "byte")))
        .at(packed_.name);
  }

  const std::string& file_;
  const PackedFile& packed_;
  std::unique_ptr<Spool> spool_;
};

ZipArchive::ZipArchive(const std::string& file) : file_(file) {
  int error = 0;
  archive_ = zip_open(file.c_str(), ZIP_RDONLY, &error);
  if (archive_ == nullptr) {
    zip_error_t reason;
    zip_error_init_with_code(&reason, error);
    const std::string text = zip_error_strerror(&reason);
    zip_error_fini(&reason);
    throw grid_fault(file, text).at("zip");
  }
}

ZipArchive::~ZipArchive() { zip_discard(archive_); }

std::vector<PackedFile> ZipArchive::find(std::string_view ending) const {
  std::vector<PackedFile> matches;
  const auto files =
      static_cast<std::uint64_t>(std::max<zip_int64_t>(0, zip_get_num_entries(archive_, 0)));
  for (std::uint64_t number = 0; number < files; ++number) {
    zip_stat_t status;
    if (zip_stat_index(archive_, number, 0, &status) != 0) continue;
    constexpr zip_uint64_t kNeeded = ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE;
    if ((status.valid & kNeeded) != kNeeded || !lower_case(status.name).ends_with(ending)) continue;
    // macOS packs a companion file with each file.
    if (std::string_view(status.name).starts_with("__MACOSX/")) continue;
    check_growth(file_, status.name, status.comp_size, status.size);
    matches.push_back({.name = status.name, .size = status.size, .number = number});
  }
  if (matches.empty()) {
    throw grid_fault(file_, fmt::format("has no {} file", ending))
        .remedy("unpack it: 'unzip FILE'");
  }
  return matches;
}

std::unique_ptr<ByteSource> ZipArchive::unpack(const PackedFile& packed) const {
  zip_file_t* const member = zip_fopen_index(archive_, packed.number, 0);
  if (member == nullptr) {
    throw grid_fault(file_, zip_strerror(archive_)).at(packed.name).remedy("unpack it yourself");
  }
  struct Close {
    void operator()(zip_file_t* open) const { zip_fclose(open); }
  };
  const std::unique_ptr<zip_file_t, Close> close(member);
  Unpacked unpacked(file_, packed);
  std::vector<std::byte> piece(kUnpackBytes);
  for (;;) {
    const zip_int64_t got = zip_fread(member, piece.data(), piece.size());
    if (got < 0) {
      throw grid_fault(file_, zip_error_strerror(zip_file_get_error(member))).at(packed.name);
    }
    if (got == 0) return unpacked.take();
    unpacked.append({piece.data(), static_cast<std::size_t>(got)});
  }
}

/// Returns the file in a gzip file with one member. Its stated size is modulo 2^32. Throws: Error
/// if it states more bytes than its packed bytes could ever unpack to.
PackedFile find_in_gzip(const std::string& file) {
  const std::unique_ptr<ByteSource> bytes = open_file(file);
  constexpr std::uint64_t kMin = 18;  // a header of 10 bytes and a trailer of 8
  if (bytes->size() < kMin) throw grid_fault(file, "is truncated").at("gzip");
  std::array<std::byte, 4> trailer{};
  bytes->read(bytes->size() - trailer.size(), trailer);
  PackedFile packed;
  for (std::size_t i = 0; i < trailer.size(); ++i) {
    packed.size |= std::to_integer<std::uint64_t>(trailer[i]) << (8 * i);
  }
  check_growth(file, "gzip", bytes->size(), packed.size);
  return packed;
}

/// Unpacks that file. Throws: Error as ZipArchive::unpack().
std::unique_ptr<ByteSource> unpack_gzip(const std::string& file, const PackedFile& packed) {
  const std::unique_ptr<ByteSource> bytes = open_file(file);
  z_stream stream{};
  constexpr int kGzip = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzip) != Z_OK) throw std::bad_alloc();
  struct End {
    void operator()(z_stream* open) const { inflateEnd(open); }
  };
  const std::unique_ptr<z_stream, End> end(&stream);
  Unpacked unpacked(file, packed);
  std::vector<std::byte> in(kUnpackBytes), out(kUnpackBytes);
  int state = Z_OK;
  for (std::uint64_t at = 0; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      const auto more =
          static_cast<std::size_t>(std::min<std::uint64_t>(in.size(), bytes->size() - at));
      if (more == 0) throw grid_fault(file, "is truncated").at("gzip");
      bytes->read(at, {in.data(), more});
      at += more;
      stream.next_in = reinterpret_cast<Bytef*>(in.data());
      stream.avail_in = static_cast<uInt>(more);
    }
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END && state != Z_BUF_ERROR) {
      throw grid_fault(file,
                       fmt::format("is damaged: {}", stream.msg == nullptr ? "zlib" : stream.msg))
          .at("gzip");
    }
    unpacked.append({out.data(), out.size() - stream.avail_out});
  }
  return unpacked.take();
}

constexpr std::string_view kEnding = ".hgt";

/// The south-west corner, in degrees.
struct Corner {
  int longitude = 0, latitude = 0;
};

/// Returns the corner in a file name that begins with "N46E008" or the like, in any case.
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

/// packed_name: the tile's name in its archive. If it does not give the corner, the name of the
/// file must.
PlainGrid describe_tile(const std::string& file, const std::string& packed_name,
                        std::uint64_t bytes) {
  std::optional<Corner> corner = corner_of(packed_name);
  if (!corner) corner = corner_of(file);
  if (!corner) {
    throw grid_fault(file, "its name does not give its south-west corner")
        .at(packed_name)
        .remedy("rename it, for example to N46E008.hgt");
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
