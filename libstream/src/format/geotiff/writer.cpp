// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <libdeflate.h>
#include <terrace/base/thread_team.hpp>
#include <tiff.h>
#include <zstd.h>

#include "format/geotiff/directory.hpp"
#include "format/geotiff/overviews.hpp"
#include "io/bytes.hpp"
#include "io/spool.hpp"
#include "io/temporary.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/geotiff_writer.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

/// Compresses the tiles of a GeoTIFF: applies the predictor, then the compression of the options.
class TileEncoder {
 public:
  explicit TileEncoder(const GeoTiffOptions& options);
  ~TileEncoder();
  TileEncoder(const TileEncoder&) = delete;
  TileEncoder& operator=(const TileEncoder&) = delete;

  /// Returns the coded bytes of a whole tile, valid until the next call. Overwrites `samples`.
  std::span<const std::byte> encode(std::span<std::byte> samples);

 private:
  void difference(std::span<std::byte> samples);

  GeoTiffOptions options_;
  libdeflate_compressor* deflate_ = nullptr;
  std::vector<std::byte> row_, coded_;
};

/// Predictor 2 of GDAL and libtiff: each sample minus the one to its left.
template <class T>
void difference_row(std::byte* row, std::size_t columns) {
  using Bits = std::make_unsigned_t<T>;
  Bits left = 0;
  for (std::size_t i = 0; i < columns; ++i) {
    Bits value;
    std::memcpy(&value, row + i * sizeof value, sizeof value);
    const auto difference = static_cast<Bits>(value - left);
    std::memcpy(row + i * sizeof difference, &difference, sizeof difference);
    left = value;
  }
}

/// Predictor 3 (Adobe Photoshop TIFF Technical Note 3): the most significant bytes of all samples,
/// then the next ones, and so on; each byte minus the previous one.
void difference_floats(std::byte* row, std::size_t columns, std::size_t size,
                       std::vector<std::byte>& scratch) {
  scratch.assign(row, row + columns * size);
  for (std::size_t byte = 0; byte < size; ++byte) {
    const std::size_t source_index =
        std::endian::native == std::endian::little ? size - 1 - byte : byte;
    for (std::size_t i = 0; i < columns; ++i)
      row[byte * columns + i] = scratch[i * size + source_index];
  }
  for (std::size_t i = columns * size; i-- > 1;) {
    row[i] = static_cast<std::byte>(std::to_integer<unsigned>(row[i]) -
                                    std::to_integer<unsigned>(row[i - 1]));
  }
}

TileEncoder::TileEncoder(const GeoTiffOptions& options) : options_(options) {
  if (options_.compression == GeoTiffCompression::deflate) {
    deflate_ = libdeflate_alloc_compressor(std::clamp(options_.level, 1, 12));
    if (deflate_ == nullptr) throw std::bad_alloc();
  }
}

TileEncoder::~TileEncoder() { libdeflate_free_compressor(deflate_); }

void TileEncoder::difference(std::span<std::byte> samples) {
  const std::size_t size = size_of(options_.sample.type);
  for (std::size_t at = 0; at < samples.size(); at += options_.tile * size) {
    with_type(options_.sample.type, [&](auto sample) {
      using T = decltype(sample);
      if constexpr (std::is_integral_v<T>) {
        difference_row<T>(samples.data() + at, options_.tile);
      } else {
        difference_floats(samples.data() + at, options_.tile, sizeof(T), row_);
      }
    });
  }
}

std::span<const std::byte> TileEncoder::encode(std::span<std::byte> samples) {
  if (options_.compression == GeoTiffCompression::none) return samples;
  if (options_.predictor) difference(samples);
  std::size_t bytes = 0;
  if (options_.compression == GeoTiffCompression::deflate) {
    coded_.resize(libdeflate_zlib_compress_bound(deflate_, samples.size()));
    bytes = libdeflate_zlib_compress(deflate_, samples.data(), samples.size(), coded_.data(),
                                     coded_.size());
    assert(bytes > 0);
  } else {
    coded_.resize(ZSTD_compressBound(samples.size()));
    bytes =
        ZSTD_compress(coded_.data(), coded_.size(), samples.data(), samples.size(), options_.level);
    if (ZSTD_isError(bytes) != 0) throw std::bad_alloc();
  }
  return std::span(coded_).first(bytes);
}

/// Describes the file's layout to readers, as defined by GDAL's "Cloud Optimized GeoTIFF" driver.
/// The space at the end leaves room for YES instead of NO.
constexpr std::string_view kLayout =
    "GDAL_STRUCTURAL_METADATA_SIZE=000140 bytes\n"
    "LAYOUT=IFDS_BEFORE_DATA\n"
    "BLOCK_ORDER=ROW_MAJOR\n"
    "BLOCK_LEADER=SIZE_AS_UINT4\n"
    "BLOCK_TRAILER=LAST_4_BYTES_REPEATED\n"
    "KNOWN_INCOMPATIBLE_EDITION=NO\n ";
static_assert(kLayout.size() + kLayout.size() % 2 == kGeoTiffLayoutBytes);
constexpr std::size_t kFrameBytes = 4;      ///< bytes of a leader, and of a trailer
constexpr std::size_t kTilesPerThread = 2;  ///< waiting to be compressed

/// Where the tiles of a level are; 0 for those that are left out.
struct TileIndex {
  explicit TileIndex(const GeoTiffLevel& level) : offsets(level.tiles()), bytes(level.tiles()) {}

  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> bytes;
};

/// True if 4 GiB might not suffice. Compression may enlarge noise slightly.
bool needs_big(const GeoTiffOptions& options, const std::vector<GeoTiffLevel>& levels) {
  const double tile_bytes = static_cast<double>(options.tile) * options.tile *
                            static_cast<double>(size_of(options.sample.type));
  double bytes = 0;
  for (const GeoTiffLevel& level : levels) {
    bytes += static_cast<double>(level.tiles()) * (tile_bytes + tile_bytes / 64 + 64);
  }
  return bytes > 4.2e9;
}

}  // namespace

struct GeoTiffWriter::Impl {
  GeoTiffOptions options;
  std::vector<GeoTiffLevel> levels;
  std::vector<TileIndex> tiles;  ///< of each level
  bool big;
  AtomicFile file;
  std::optional<Spool> spool;  ///< tiles of a file with overviews, in the order of arrival
  /// A tile on its way to the file.
  struct QueuedTile {
    std::size_t level, number;
    std::vector<std::byte> samples, coded;
  };
  base::ThreadTeam team;
  std::deque<TileEncoder> encoders;  ///< by thread
  std::vector<QueuedTile> queue;
  std::size_t queued = 0;
  Overviews overviews;
  std::vector<std::byte> band;  ///< the rows of one row of tiles
  std::vector<std::byte> tile;  ///< one tile of `band`
  std::uint32_t next_row = 0;   ///< of write_rows
  bool by_rows = false;

  Impl(const std::filesystem::path& path, const GeoTiffOptions& geotiff_options)
      : options(geotiff_options),
        levels(levels_of(options)),
        tiles(levels.begin(), levels.end()),
        big(needs_big(options, levels)),
        file(path, options.replace),
        team(options.threads),
        queue(team.threads() == 1 ? 1 : kTilesPerThread * team.threads()),
        overviews(
            options, levels,
            [this](std::size_t level, std::uint32_t across, std::uint32_t down,
                   std::span<const std::byte> samples) { put(level, across, down, samples); }),
        tile(std::size_t{options.tile} * options.tile * sample_bytes()) {
    for (unsigned i = 0; i < team.threads(); ++i) encoders.emplace_back(options);
    if (options.overviews == GeoTiffOverviews::none) {
      file.write(tiff_head(big, 0));
    } else {
      spool.emplace(path.string(), folder_of(path));
    }
  }

  [[nodiscard]] std::size_t sample_bytes() const { return size_of(options.sample.type); }

  void check_stop() const {
    if (options.stop.stop_requested()) throw Stopped();
  }
  void put(std::size_t level, std::uint32_t across, std::uint32_t down,
           std::span<const std::byte> samples) {
    check_stop();
    QueuedTile& entry = queue[queued++];
    entry.level = level;
    entry.number = std::size_t{down} * levels[level].across + across;
    entry.samples.assign(samples.begin(), samples.end());
    if (queued == queue.size()) write_queue();
  }
  /// Compresses the queued tiles on all threads and writes them in the order of arrival.
  void write_queue() {
    team.run(queued, [this](std::size_t i, std::size_t worker) {
      const std::span<const std::byte> coded = encoders[worker].encode(queue[i].samples);
      queue[i].coded.assign(coded.begin(), coded.end());
    });
    for (const QueuedTile& entry : std::span(queue).first(queued)) {
      TileIndex& index = tiles[entry.level];
      index.bytes[entry.number] = static_cast<std::uint32_t>(entry.coded.size());
      index.offsets[entry.number] = spool ? spool->size() : file.size();
      if (spool) {
        spool->append(entry.coded);
      } else {
        file.write(entry.coded);
      }
    }
    queued = 0;
  }

  void put_tile(std::uint32_t across, std::uint32_t down, std::span<const std::byte> samples) {
    overviews.add(across, down, samples);
    put(0, across, down, samples);
  }

  void flush_band(std::uint32_t rows);
  [[nodiscard]] TiffDirectory directory(std::size_t level) const;
  void finish_plain();
  void finish_with_overviews();
};

/// Writes the band's tiles. Cells beyond the raster repeat its edge, which compresses best. rows:
/// how many the band has.
void GeoTiffWriter::Impl::flush_band(std::uint32_t rows) {
  const std::size_t size = sample_bytes(), side = options.tile;
  const std::size_t row_bytes = options.columns * size;
  const std::uint32_t down = (next_row - 1) / options.tile;
  for (std::uint32_t across = 0; across < levels.front().across; ++across) {
    const std::size_t first = across * side;
    const std::size_t width = std::min<std::size_t>(side, options.columns - first);
    for (std::size_t row = 0; row < side; ++row) {
      const std::size_t source_index = std::min<std::size_t>(row, rows - 1);
      std::byte* const out = tile.data() + row * side * size;
      std::memcpy(out, band.data() + source_index * row_bytes + first * size, width * size);
      for (std::size_t i = width; i < side; ++i) {
        std::memcpy(out + i * size, out + (width - 1) * size, size);
      }
    }
    put_tile(across, down, tile);
  }
}

TiffDirectory GeoTiffWriter::Impl::directory(std::size_t level) const {
  TiffDirectory directory =
      tags_of(options, static_cast<unsigned>(level), levels[level].columns, levels[level].rows);
  const TileIndex& index = tiles[level];
  if (big) {
    directory.add(TIFFTAG_TILEOFFSETS, index.offsets);
  } else {
    directory.add(TIFFTAG_TILEOFFSETS,
                  std::vector<std::uint32_t>(index.offsets.begin(), index.offsets.end()));
  }
  directory.add(TIFFTAG_TILEBYTECOUNTS, index.bytes);
  return directory;
}

/// Writes the directory after the tiles.
void GeoTiffWriter::Impl::finish_plain() {
  write_queue();
  if (file.size() % 2 != 0) file.write(std::string_view("\0", 1));
  const std::uint64_t at = file.size();
  file.write(directory(0).bytes(big, at, 0));
  const std::string head = tiff_head(big, at);
  file.write_at(0, std::as_bytes(std::span(head)));
}

/// Writes the directories, then the tiles, beginning with those of the smallest overview.
void GeoTiffWriter::Impl::finish_with_overviews() {
  overviews.finish();
  write_queue();
  std::vector<std::uint64_t> directory_at{tiff_head(big, 0).size() + kGeoTiffLayoutBytes};
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const std::uint64_t at = directory_at.back();
    directory_at.push_back(at + directory(level).bytes(big, at, 0).size());
  }
  const std::vector<TileIndex> spooled = tiles;
  std::uint64_t end = directory_at.back();
  for (std::size_t level = levels.size(); level-- > 0;) {
    for (std::size_t i = 0; i < levels[level].tiles(); ++i) {
      if (spooled[level].bytes[i] == 0) continue;
      tiles[level].offsets[i] = end + kFrameBytes;
      end += spooled[level].bytes[i] + 2 * kFrameBytes;
    }
  }
  file.write(tiff_head(big, directory_at.front()));
  file.write(kLayout);
  file.write(std::string(directory_at.front() - file.size(), '\0'));
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const bool last = level + 1 == levels.size();
    file.write(
        directory(level).bytes(big, directory_at[level], last ? 0 : directory_at[level + 1]));
  }
  std::vector<std::byte> coded;
  for (std::size_t level = levels.size(); level-- > 0;) {
    for (std::size_t i = 0; i < levels[level].tiles(); ++i) {
      if (spooled[level].bytes[i] == 0) continue;
      check_stop();
      coded.resize(spooled[level].bytes[i]);
      spool->read(spooled[level].offsets[i], coded);
      std::string leader;
      append_little_endian(leader, spooled[level].bytes[i]);
      file.write(leader);
      assert(file.size() == tiles[level].offsets[i]);
      file.write(coded);
      file.write(std::span(coded).last(kFrameBytes));
    }
  }
}

std::uint64_t geotiff_table_bytes(const GeoTiffOptions& options) {
  // With overviews, two copies of the table are held while the file is assembled, and one directory
  // at a time is built from it.
  constexpr std::uint64_t kTable = sizeof(std::uint64_t) + sizeof(std::uint32_t);
  const std::vector<GeoTiffLevel> levels = levels_of(options);
  std::uint64_t bytes = 3 * kTable * levels.front().tiles();
  for (const GeoTiffLevel& level : levels) bytes += 2 * kTable * level.tiles();
  return bytes;
}

GeoTiffWriter::GeoTiffWriter(const std::filesystem::path& path, const GeoTiffOptions& options) {
  assert(options.columns > 0 && options.rows > 0);
  assert(options.tile > 0 && options.tile % 16 == 0);
  impl_ = std::make_unique<Impl>(path, options);
}

GeoTiffWriter::~GeoTiffWriter() = default;
GeoTiffWriter::GeoTiffWriter(GeoTiffWriter&&) noexcept = default;
GeoTiffWriter& GeoTiffWriter::operator=(GeoTiffWriter&&) noexcept = default;

void GeoTiffWriter::write_rows(std::span<const std::byte> samples) {
  Impl& impl = *impl_;
  const std::size_t row_bytes = impl.options.columns * impl.sample_bytes();
  assert(samples.size() % row_bytes == 0);
  assert(samples.size() / row_bytes <= impl.options.rows - impl.next_row);
  impl.by_rows = true;
  impl.band.resize(impl.options.tile * row_bytes);
  while (!samples.empty()) {
    const std::uint32_t at = impl.next_row % impl.options.tile;
    const std::size_t rows =
        std::min<std::size_t>(samples.size() / row_bytes, impl.options.tile - at);
    std::memcpy(impl.band.data() + at * row_bytes, samples.data(), rows * row_bytes);
    samples = samples.subspan(rows * row_bytes);
    impl.next_row += static_cast<std::uint32_t>(rows);
    const auto filled = static_cast<std::uint32_t>(at + rows);
    if (filled == impl.options.tile || impl.next_row == impl.options.rows) impl.flush_band(filled);
  }
}

void GeoTiffWriter::write_tile(std::uint32_t across, std::uint32_t down,
                               std::span<const std::byte> samples) {
  Impl& impl = *impl_;
  assert(!impl.by_rows);
  assert(across < impl.levels.front().across && down < impl.levels.front().down);
  impl.check_stop();
  if (samples.empty()) {
    impl.overviews.add(across, down, {});
    return;
  }
  assert(samples.size() == impl.tile.size());
  impl.put_tile(across, down, samples);
}

void GeoTiffWriter::commit() {
  Impl& impl = *impl_;
  assert(!impl.by_rows || impl.next_row == impl.options.rows);
  if (impl.spool) {
    impl.finish_with_overviews();
  } else {
    impl.finish_plain();
  }
  impl.file.commit();
}

}  // namespace terrace::stream
