// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// The LAZ codec: encodes LAS point records as LASzip chunks and decodes them, bit for bit. It
/// handles bytes only; the readers and writers of files handle headers.
///
/// A LAZ file (point format byte + 128) has a LASzip VLR among its VLRs. Where the records of a LAS
/// file would begin, it has 8 bytes with the chunk table's position in the file (int64), then the
/// chunks without gaps, then the table. With Compressor::pointwise it has only the chunk. A
/// position of -1 means that the table's position is in the last 8 bytes of the file instead. The
/// field's own position means that the writer stopped before it wrote the table.
///
/// Source: M. Isenburg, LASzip: lossless compression of LiDAR data, PE&RS 79(2), 2013; A. Said,
/// Introduction to arithmetic coding, HPL-2004-76.

namespace terrace::stream::laz {

/// Thrown for bytes that LASzip cannot have written.
class Corrupt : public std::runtime_error {
 public:
  Corrupt(const std::string& cause, std::uint64_t offset)
      : std::runtime_error(cause), offset_(offset) {}

  /// Offset in the given bytes (a chunk, a table, a VLR's payload) at which the fault was found.
  [[nodiscard]] std::uint64_t offset() const noexcept { return offset_; }

 private:
  std::uint64_t offset_;
};

enum class Compressor : std::uint16_t {
  none = 0,               ///< records as in LAS
  pointwise = 1,          ///< all points in one chunk, no chunk table
  pointwise_chunked = 2,  ///< point formats 0 to 5
  layered = 3,            ///< point formats 6 to 10: each attribute is a separate byte string
};

/// A part of the point record that is coded separately.
enum class ItemType : std::uint16_t {
  byte = 0,
  point10 = 6,
  gps_time11 = 7,
  rgb12 = 8,
  wave_packet13 = 9,
  point14 = 10,
  rgb14 = 11,
  rgb_nir14 = 12,
  wave_packet14 = 13,
  byte14 = 14,
};

/// An item of the LASzip VLR: a part of the record and the version of its coding.
struct Item {
  ItemType type = ItemType::byte;
  std::uint16_t size = 0;  ///< bytes in the record
  std::uint16_t version = 0;

  friend bool operator==(const Item&, const Item&) = default;
};

/// The LASzip VLR, which says how the points of a file are coded.
struct Vlr {
  static constexpr std::string_view kUserId = "laszip encoded";
  static constexpr std::uint16_t kRecordId = 22204;
  /// A chunk_size that means that the chunk table has the number of points of each chunk.
  static constexpr std::uint32_t kVariable = 0xffffffff;
  /// A bit of `options`: formats 6 to 10 are stored as formats 1 to 5 with extra bytes.
  static constexpr std::uint32_t kCompatibility = 1;

  Compressor compressor = Compressor::layered;
  std::uint32_t options = 0;
  std::uint32_t chunk_size = 50'000;  ///< points per chunk, except the last one
  std::vector<Item> items;            ///< in the order of the record

  /// Returns LASzip's default coding of a point format. Throws: std::invalid_argument unless
  /// point_format <= 10 and record_length is between the format's and 65,535 (more than the
  /// format's: extra bytes).
  static Vlr of(unsigned point_format, std::size_t record_length,
                std::uint32_t chunk_size = 50'000);
  /// Reads a VLR's payload (the bytes after its header of 54 bytes). Throws: Corrupt unless this
  /// codec supports the VLR and its items match the LAS header's point format (0 to 10, with bits 6
  /// and 7 removed) and record length.
  static Vlr parse(std::span<const std::byte> payload, unsigned point_format,
                   std::size_t record_length);

  /// Returns the payload.
  [[nodiscard]] std::vector<std::byte> serialise() const;
  [[nodiscard]] std::size_t record_length() const;
};

/// A run of points that is coded independently of the others.
struct Chunk {
  std::uint64_t offset = 0;  ///< of its first byte, counted from the first chunk's
  std::uint64_t bytes = 0;
  std::uint64_t points = 0;

  friend bool operator==(const Chunk&, const Chunk&) = default;
};

/// Reads a chunk table from the bytes at its position; other bytes may follow it. points: the
/// number in the LAS header; bytes: the number from the first chunk to the table. Drops entries
/// without points, which some writers append. Memory: 24 bytes per chunk.
/// Throws: Corrupt for a damaged table, and unless its chunks add up to exactly these points and
/// bytes.
std::vector<Chunk> read_chunk_table(std::span<const std::byte> table, const Vlr& vlr,
                                    std::uint64_t points, std::uint64_t bytes);

/// Returns the bytes of a chunk table. Unless vlr.chunk_size is kVariable, all chunks except the
/// last must have that many points. Throws: std::invalid_argument if they do not, and for more than
/// 2^32 - 1 chunks, or points or bytes in a chunk.
std::vector<std::byte> write_chunk_table(std::span<const Chunk> chunks, const Vlr& vlr);

/// Returns the number of leading bytes that layered_chunk() needs. Layered chunks contain their
/// size, so they can be read without a table.
std::size_t layered_head_size(const Vlr& vlr);

/// Returns the points and bytes of the layered chunk that begins with `head`, with offset 0. Does
/// not validate the numbers. Throws: Corrupt if `head` is too short.
Chunk layered_chunk(const Vlr& vlr, std::span<const std::byte> head);

/// Attributes of layered chunks, as bits of a mask. X, Y, the returns and the scanner channel are
/// always decoded; in an attribute that is not, all records have the value of the chunk's first
/// point. Other kinds of chunks are decoded completely.
enum Attributes : std::uint32_t {
  kZ = 1u << 0,
  kClassification = 1u << 1,
  kFlags = 1u << 2,  ///< classification flags, scan direction, edge of flight line
  kIntensity = 1u << 3,
  kScanAngle = 1u << 4,
  kUserData = 1u << 5,
  kPointSource = 1u << 6,
  kGpsTime = 1u << 7,
  kRgb = 1u << 8,
  kNir = 1u << 9,
  kWavePacket = 1u << 10,
  kExtraByte0 = 1u << 16,  ///< shifted left by i for extra byte i; the highest bit: all from 15 on
  kAllAttributes = 0xffffffff,
};

/// Decodes chunks one after the other, in any order; each thread needs its own. Time O(points).
/// Memory: the models used by a chunk, 0.2 to 2.5 MiB plus 1 to 5 KiB per extra byte.
class Decoder {
 public:
  /// Throws: std::invalid_argument for Compressor::none and for items that Vlr::parse() refuses.
  explicit Decoder(const Vlr& vlr, std::uint32_t attributes = kAllAttributes);
  ~Decoder();
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;

  /// Decodes a complete chunk of records.size() / record_length points. Throws: Corrupt for damage,
  /// and if the last point does not end at the chunk's last byte; `records` are then unspecified.
  void decode_chunk(std::span<const std::byte> chunk, std::span<std::byte> records);

  /// The progress of a step.
  struct Step {
    std::size_t bytes = 0;   ///< consumed; must not be passed again
    std::size_t points = 0;  ///< decoded
  };
  /// Begins a chunk of this many points, to be decoded by step(). For a chunk that is decoded in
  /// pieces, or whose end is unknown because it comes from a pipe.
  void start(std::uint64_t points);
  /// Decodes the chunk's next points, until `records` is full or `bytes` run out. bytes: those
  /// after the bytes consumed before. A layered chunk must be passed completely, at the same
  /// address in each step; its last point consumes it. last: no more bytes follow. If they do, a
  /// point of a pointwise chunk is left to the next step when fewer than 512 bytes + 4 per extra
  /// byte remain. Throws: Corrupt, with the offset in the chunk.
  Step step(std::span<const std::byte> bytes, bool last, std::span<std::byte> records);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Encodes chunks; each thread needs its own. Memory as for decoding, plus a copy of the coded
/// bytes of a layered chunk.
class Encoder {
 public:
  /// Throws: std::invalid_argument under the same conditions as Decoder.
  explicit Encoder(const Vlr& vlr);
  ~Encoder();
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;

  /// Encodes `records`, at least one point, and appends the chunk to `out`. Its bytes are identical
  /// to LASzip's. Throws: std::invalid_argument if records.size() is 0, is not a multiple of the
  /// record length, or is more than 2^32 - 1 points.
  void encode_chunk(std::span<const std::byte> records, std::vector<std::byte>& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::stream::laz
