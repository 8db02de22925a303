// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "net/http_client.hpp"
#include "net/origin.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/given_bytes.hpp"
#include "terrace/stream/network.hpp"

namespace terrace::stream::net {

/// The files below a URL, read by ranges and kept in memory up to a limit. Threads that need the
/// same bytes request them once. Thread-safe.
class RemoteFolder : public std::enable_shared_from_this<RemoteFolder> {
 public:
  /// Throws: Error for a malformed URL.
  RemoteFolder(const std::string& url, const NetworkOptions& options);

  /// States the size of a file, so that opening it needs no request. An answer with another size is
  /// an error then.
  void expect(const std::string& file, std::uint64_t bytes);
  /// Opens a file. If its size is not known, requests its beginning. Throws: Error.
  [[nodiscard]] std::unique_ptr<ByteSource> open(const std::string& file);

  /// Throws: Error.
  void read(const std::string& file, std::uint64_t offset, std::span<std::byte> out);
  /// Requests what is missing of these ranges, of at most prefetch_bytes() together, all at
  /// once. The files must be open or expected.
  /// Throws: Error.
  void prefetch(std::span<const ByteRange> ranges);
  /// A share of the cache, so that the bytes of a prefetch stay until they are read.
  [[nodiscard]] std::uint64_t prefetch_bytes() const { return cache_bytes_ / 4; }
  [[nodiscard]] std::string shown(const std::string& file) const { return origin_.shown(file); }

 private:
  /// A sequence of reads, each of which begins where the one before ended.
  struct Stream {
    std::uint64_t next = 0, ahead = 0;
  };
  struct File {
    std::optional<std::uint64_t> size{};
    bool connected = false;  ///< whether there was an answer, which the validators are of
    std::string etag{};      ///< only a strong one
    std::string last_modified{};
    std::array<Stream, 16> streams{};
    std::size_t oldest_stream = 0;
  };
  using Lock = std::unique_lock<std::mutex>;

  void read_part(const ByteRange& range, std::span<std::byte> out);
  /// Requests ranges and keeps their bytes. lock: held on entry and exit, not meanwhile.
  void request(Lock& lock, const std::vector<ByteRange>& ranges);
  [[nodiscard]] HttpTask task_for(const ByteRange& range);
  /// Checks an answer and keeps its bytes. Throws: Error.
  void take(const ByteRange& range, HttpAnswer& answer);
  void check_validators(const std::string& file, std::uint64_t size, const HttpAnswer& answer);
  [[nodiscard]] Error changed(const std::string& file) const;
  /// Waits until no other thread requests bytes of these ranges.
  void wait_for_others(Lock& lock, std::span<const ByteRange> ranges);
  /// Returns the range to request for a read, which may be longer than the read.
  [[nodiscard]] ByteRange with_read_ahead(File& file, ByteRange range);

  HttpClient client_;
  Origin origin_;
  std::chrono::milliseconds deadline_;
  std::uint64_t cache_bytes_;

  std::mutex mutex_;
  std::condition_variable arrived_;
  GivenBytes held_;
  OpenByName open_held_;
  std::map<std::string, File> files_;
  std::vector<ByteRange> requested_;
};

}  // namespace terrace::stream::net
