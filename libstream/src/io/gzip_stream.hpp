// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream {

/// Unpacks gzip (RFC 1952) as its bytes come, one member after another (as bgzip and `cat a.gz
/// b.gz` write them). Holds 128 KiB.
class GzipStream {
 public:
  /// Reads packed bytes, at most so many; 0 at their end.
  using Read = std::function<std::size_t(char* to, std::size_t most)>;

  /// name: of the input, for messages. first: packed bytes that have been read already.
  explicit GzipStream(std::string name, std::string_view first = {});
  ~GzipStream();
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  /// Unpacked bytes, at least one unless they have ended. Requires: most > 0. Throws: Error, naming
  /// the place in the packed bytes, if they are damaged, end within a member, or are followed by
  /// what is no member; what `read` throws.
  std::size_t read(char* to, std::size_t most, const Read& read);

 private:
  struct Inflater;

  [[noreturn]] void fail(const std::string& cause) const;
  /// Reads more packed bytes behind those that are left; false at their end.
  bool refill(const Read& read);

  std::string name_;
  std::unique_ptr<Inflater> inflater_;
  std::vector<char> packed_;
  std::size_t begin_ = 0, end_ = 0;  ///< of packed_, what has not been unpacked
  std::uint64_t used_ = 0;           ///< packed bytes before begin_
  bool in_member_ = true;
};

}  // namespace terrace::stream
