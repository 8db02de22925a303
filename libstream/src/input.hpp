// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream {

/// The name that stands for standard input, and for standard output where one is written.
inline constexpr std::string_view kStandardStream = "-";

/// The bytes of a file, a pipe or standard input ("-") from first to last, through a window that
/// moves forward. Holds the window, never the file.
class Input {
 public:
  /// Throws: Error if the file cannot be opened or is a folder.
  explicit Input(const std::string& file);
  ~Input();
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

  /// The unread bytes that are in memory. Valid until the next fill() or skip().
  [[nodiscard]] std::string_view window() const { return {buffer_.data() + begin_, end_ - begin_}; }
  /// Reads until the window has `wanted` bytes or the input ends; returns the window. The window
  /// grows to what is asked, so callers bound it.
  std::string_view fill(std::size_t wanted);
  /// Moves past the first `count` bytes of the window.
  void consume(std::size_t count);
  /// Moves past `count` bytes wherever they are; false if the input ends before.
  bool skip(std::uint64_t count);

  /// Bytes consumed so far.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  /// Size of a regular file; nothing for pipes.
  [[nodiscard]] std::optional<std::uint64_t> size() const { return size_; }
  /// As the caller named it, "standard input" for "-".
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  /// One read into the free end of the buffer; false at the end of the input.
  bool read_more();

  std::string name_;
  int fd_ = -1;
  bool owned_ = false;
  bool ended_ = false;
  std::optional<std::uint64_t> size_;
  std::uint64_t offset_ = 0;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;
};

/// True for a file that can be opened again from its start; false for pipes and standard input.
bool is_rereadable(const std::string& file);

/// The first bytes of a file, at most `most`. What is read from a pipe is kept for the next Input
/// of that name on this thread, or until drop_heads(). Throws: Error if the file cannot be opened
/// or read.
std::vector<char> peek_head(const std::string& file, std::size_t most);
/// Forgets what peek_head() has kept and nobody has taken.
void drop_heads();

}  // namespace terrace::stream
