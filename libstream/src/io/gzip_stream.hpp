// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/error.hpp"

namespace terrace::stream {

/// Decompresses gzip (RFC 1952) as its bytes arrive, one member after another (as written by bgzip
/// and `cat a.gz b.gz`). Holds 128 KiB.
class GzipStream {
 public:
  /// Reads at most `max_bytes` compressed bytes; returns 0 at their end.
  using Read = std::function<std::size_t(char* out, std::size_t max_bytes)>;

  /// name: the input, named in errors. first: compressed bytes that have already been read.
  explicit GzipStream(std::string name, std::string_view first = {});
  ~GzipStream();
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  /// Returns how many decompressed bytes it wrote to `out`: at least one, or 0 at the end. Requires
  /// max_bytes > 0. Throws: Error, naming the position in the compressed bytes, if they are
  /// damaged, end within a member, or are followed by anything but a member; whatever `read`
  /// throws.
  std::size_t read(char* out, std::size_t max_bytes, const Read& read);

 private:
  struct Inflater;

  [[nodiscard]] Error fault(std::string cause) const;
  /// Reads more compressed bytes and appends them to those not yet used; false at their end.
  bool refill(const Read& read);

  std::string name_;
  std::unique_ptr<Inflater> inflater_;
  std::vector<char> packed_;
  std::size_t begin_ = 0, end_ = 0;  ///< in packed_: bytes not yet decompressed
  std::uint64_t used_ = 0;           ///< compressed bytes before begin_
  bool in_member_ = true;
};

}  // namespace terrace::stream
