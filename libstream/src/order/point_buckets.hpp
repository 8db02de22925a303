// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "io/spool.hpp"
#include "order/kd_cut.hpp"
#include "order/record_packer.hpp"
#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Maximum memory of a bucket: 8 MiB for 256 buckets, and large enough that writes are few.
inline constexpr std::size_t kBucketBytes = 32u << 10;

/// Packs points as records of their stored types: the coordinates, then the attributes.
class PackedPoints {
 public:
  explicit PackedPoints(const Schema& schema);

  [[nodiscard]] std::size_t record_bytes() const { return record_bytes_; }
  /// Sets `records` to the records of the block's points.
  void pack(const PointBlock& block, std::vector<std::byte>& records) const;
  /// Whether the values of all coordinates' types fit a 32-bit signed integer.
  [[nodiscard]] bool integers() const { return integers_; }
  /// Sets `points` to the places in the records, numbered from 0. 32-bit integer coordinates
  /// require integers().
  template <class Coordinate>
  void unpack(std::span<const std::byte> records, std::vector<Numbered<Coordinate>>& points) const;
  /// Sorts the records by key into `sorted`; records of equal key keep their order. Sets `begins`
  /// to the index at which each key below `keys_end` begins, followed by the number of records.
  void sort(std::span<const std::byte> records, std::span<const std::uint16_t> keys,
            std::size_t keys_end, std::vector<std::byte>& sorted,
            std::vector<std::size_t>& begins) const;
  /// Sorts the records of a block likewise.
  void sort(const PointBlock& block, std::span<const std::uint16_t> keys, std::size_t keys_end,
            std::vector<std::byte>& sorted, std::vector<std::size_t>& begins) const;
  /// Sets `block` to the records with these numbers, counted from 0.
  void unpack(std::span<const std::byte> records, std::span<const std::uint32_t> numbers,
              PointBlock& block) const;

 private:
  [[nodiscard]] std::size_t payload_bytes() const { return record_bytes_ - payload_offset_; }
  /// Calls write(pack), where pack(i, to) writes the record of point i of the block.
  template <class Write>
  void with_packing(const PointBlock& block, const Write& write) const;
  /// Calls read(unpack), where unpack(record) returns the record's place.
  template <class Coordinate, class Read>
  void with_unpacking(const Read& read) const;
  /// Sorts as sort() does, with put(i, to) to write record i.
  template <class Put>
  void sort_by(std::span<const std::uint16_t> keys, std::size_t keys_end,
               std::vector<std::byte>& sorted, std::vector<std::size_t>& begins,
               const Put& put) const;

  std::array<ScalarType, 3> types_;
  std::array<std::size_t, 3> offsets_{};
  std::size_t payload_offset_, record_bytes_;
  bool integers_ = true;
};

/// Records that belong together, in order of arrival: full chunks in a file, the rest in memory.
struct Bucket {
  /// A chunk of records in the file.
  struct Chunk {
    std::uint32_t page, pages;  ///< its position, in pages of the file
    std::uint32_t bytes;        ///< bytes used; if as many as in memory, they are not packed
  };

  std::vector<Chunk> chunks;
  std::vector<std::byte> tail;

  void append(Bucket&& next);
};

/// Keeps buckets of records in one temporary file, in chunks whose space is reused once they have
/// been read.
class BucketFile {
 public:
  /// Creates the file in `folder`. name: the points' source, named in errors.
  BucketFile(const std::string& name, const std::filesystem::path& folder,
             std::size_t record_bytes);

  /// Appends records. Several threads may append at once, each with its own packer and buckets.
  /// Throws: Error, usually because the disk is full.
  void append(Bucket& bucket, std::span<const std::byte> records, RecordPacker& packer);
  /// Appends records while no other thread appends.
  void append(Bucket& bucket, std::span<const std::byte> records) {
    append(bucket, records, packer_);
  }
  [[nodiscard]] std::uint64_t records(const Bucket& bucket) const;
  /// Moves the first records of the bucket, complete chunks of about `max_records` records, to
  /// `out`, replacing its contents.
  void take(Bucket& bucket, std::uint64_t max_records, std::vector<std::byte>& out);
  /// Copies at most `max_records` records, from chunks throughout the bucket, to `out`.
  void sample(const Bucket& bucket, std::uint64_t max_records, std::vector<std::byte>& out);
  /// Size of the file in bytes.
  [[nodiscard]] std::uint64_t bytes() const { return pages_ * kPageBytes; }

 private:
  /// Unit of positions in the file, which can have up to 4 TiB.
  static constexpr std::uint64_t kPageBytes = 1024;
  /// Chunks at the end of the file are written together, at least this many bytes, because short
  /// writes cost the system more, and so does reading what they wrote.
  static constexpr std::size_t kMinWriteBytes = 256u << 10;

  Bucket::Chunk allocate(std::size_t bytes);
  void write(Bucket& bucket, RecordPacker& packer);
  void read(const Bucket::Chunk& chunk, std::span<std::byte> records);

  std::size_t record_bytes_, chunk_bytes_;  ///< before packing
  Spool file_;
  RecordPacker packer_;
  std::vector<std::byte> packed_;
  std::mutex mutex_;                    ///< guards the members below
  std::uint32_t pages_ = 0;             ///< pages of the file, including chunks to be written
  std::uint64_t unwritten_page_ = 0;    ///< end of the pages written
  std::vector<std::byte> unwritten_;    ///< to be written from there on
  std::vector<std::byte> free_buffer_;  ///< an empty buffer
  std::map<std::uint32_t, std::vector<std::uint32_t>> free_;  ///< free positions, by size in pages
};

}  // namespace terrace::stream
