// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrace/stream/byte_source.hpp"

namespace terrace::stream {

/// A part of a file.
struct ByteRange {
  std::string file;
  std::uint64_t offset = 0, bytes = 0;

  friend bool operator==(const ByteRange&, const ByteRange&) = default;
};

/// Bytes that nobody has given yet. Not a fault: give them and do the same again.
class MissingBytes : public std::runtime_error {
 public:
  explicit MissingBytes(std::vector<ByteRange> ranges);
  [[nodiscard]] const std::vector<ByteRange>& ranges() const { return ranges_; }

 private:
  std::vector<ByteRange> ranges_;
};

/// Files of which only those parts are there that somebody has given, so that a store can be read
/// by one who cannot wait: in a browser, whose requests come back when they will. What is read of
/// such a file is copied if it is there; if not, the read throws MissingBytes, which names what to
/// bring.
///
/// One thread at a time. The sources that open() gives share what was given and stay valid.
class GivenBytes {
 public:
  /// max_bytes: beyond it the parts that were read or given longest ago are dropped (and missing
  /// again when they are read). One part, however large, is always kept.
  explicit GivenBytes(std::uint64_t max_bytes = std::uint64_t{64} << 20);
  ~GivenBytes();
  GivenBytes(GivenBytes&&) noexcept;
  GivenBytes& operator=(GivenBytes&&) noexcept;

  /// A file of this size is there; to be told before it is opened. Throws: Error if it was told
  /// with another size.
  void add_file(const std::string& name, std::uint64_t size);
  /// Bytes that are already there are kept as they are. Throws: Error if the file is not there or
  /// is smaller.
  void give(const std::string& name, std::uint64_t offset, std::span<const std::byte> bytes);
  /// Forgets what was given of a file, as after bytes that turned out to be damaged.
  void forget(const std::string& name);

  /// For Store::open(). Throws: Error for files that are not there.
  [[nodiscard]] OpenByName open() const;
  /// Whether all these bytes are there. O(log n).
  [[nodiscard]] bool has(const ByteRange& range) const;
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace terrace::stream
