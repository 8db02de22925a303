// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream {

/// The name of standard input, and for writers of standard output.
inline constexpr std::string_view kStandardStream = "-";

/// Whether `file` is standard input or a pipe: bytes that can be read only once, by one reader.
[[nodiscard]] bool reads_once(const std::string& file);

class GzipStream;

/// The bytes of a file, a pipe or standard input ("-") from first to last, through a window that
/// moves forward. Holds the window, never the whole file. Input that begins with the signature of
/// gzip is decompressed, unless Packed::as_it_is is passed; windows and offsets then refer to the
/// decompressed bytes.
///
/// Any wait for a pipe (for its first writer, or for more bytes) ends with Stopped as soon as a
/// stop is requested, from any thread.
class Input {
 public:
  /// Whether gzip input is decompressed. as_it_is: for bytes that may begin like gzip by chance.
  enum class Packed : std::uint8_t { unpacked, as_it_is };

  /// at_once: bytes per read. Does not wait for the first writer of a pipe. Throws: Error if the
  /// file cannot be opened.
  explicit Input(const std::string& file, const std::stop_token& stop = {},
                 std::size_t at_once = std::size_t{256} << 10, Packed packed = Packed::unpacked);
  ~Input();
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

  /// The unread bytes in memory. Valid until the next fill() or skip().
  [[nodiscard]] std::string_view window() const { return {buffer_.data() + begin_, end_ - begin_}; }
  /// Reads until the window has `min_bytes` bytes or the input ends; returns the window. The window
  /// grows to the requested size, so callers must bound it. Throws: Error, Stopped.
  std::string_view fill(std::size_t min_bytes);
  /// Moves past the first `count` bytes of the window.
  void consume(std::size_t count);
  /// Moves past `count` bytes, read or not; false if the input ends before that. Throws: Error,
  /// Stopped.
  bool skip(std::uint64_t count);

  /// Bytes consumed so far.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  /// Size of a regular file; nullopt for pipes and gzip.
  [[nodiscard]] std::optional<std::uint64_t> size() const { return size_; }
  /// The name as the caller gave it; "standard input" for "-".
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  class Descriptor;

  Input& operator=(Input&&) noexcept;
  /// Reads once into the free end of the buffer; false at the end of the input.
  bool read_more();

  std::string name_;
  std::unique_ptr<Descriptor> descriptor_;
  std::unique_ptr<GzipStream> gzip_;
  bool gzip_checked_ = false;  ///< whether it was checked for gzip
  bool ended_ = false;
  std::optional<std::uint64_t> size_;
  std::uint64_t offset_ = 0;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace terrace::stream
