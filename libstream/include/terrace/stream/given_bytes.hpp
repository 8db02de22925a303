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

/// Thrown for bytes that have not been given yet. Not a fault: give them and try again.
class MissingBytes : public std::runtime_error {
 public:
  explicit MissingBytes(std::vector<ByteRange> ranges);
  [[nodiscard]] const std::vector<ByteRange>& ranges() const { return ranges_; }

 private:
  std::vector<ByteRange> ranges_;
};

/// Partial files in memory, of which callers give the parts. They let a store be read where reads
/// cannot wait, as in a browser, whose requests are asynchronous. A read copies the bytes if all
/// are held; otherwise it throws MissingBytes, which names the range of the read.
///
/// Not thread-safe. The sources that open() returns share the given bytes and stay valid.
class GivenBytes {
 public:
  /// max_bytes: the limit of the bytes held. Beyond it, the least recently read or given parts are
  /// dropped, and are missing again when they are read. A single part may exceed the limit: the
  /// last one is always kept. If some of its bytes were held before, it is stored in pieces, and
  /// only the last piece is sure to be kept.
  explicit GivenBytes(std::uint64_t max_bytes = std::uint64_t{64} << 20);
  ~GivenBytes();
  GivenBytes(GivenBytes&&) noexcept;
  GivenBytes& operator=(GivenBytes&&) noexcept;

  /// Declares a file and its size; must be called before the file is opened. Throws: Error if it
  /// was declared with another size.
  void add_file(const std::string& name, std::uint64_t size);
  /// Gives a part of a file. Bytes that were given before keep their values. Throws: Error if the
  /// file is not declared or is smaller.
  void give(const std::string& name, std::uint64_t offset, std::span<const std::byte> bytes);
  /// Forgets the given bytes of a file, for example because they turned out to be damaged.
  void forget(const std::string& name);

  /// Returns the function for Store::open(), which throws Error for files that are not declared.
  [[nodiscard]] OpenByName open() const;
  /// Whether all these bytes are held. O(log n).
  [[nodiscard]] bool has(const ByteRange& range) const;
  /// Bytes held now.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace terrace::stream
