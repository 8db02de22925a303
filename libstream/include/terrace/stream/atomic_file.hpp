// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace terrace::stream {

/// A file that appears under its name whole and synced, or not at all.
///
/// Bytes go to a temporary file beside the target, `.terrace-HASH.tmp-PID`, which is locked
/// while its writer lives. `commit()` syncs it and renames it to the target; an object destroyed
/// before that, by an exception say, removes it. What a writer that was killed has left behind is
/// removed by the next one for the same target.
///
///     AtomicFile file("out.ply");
///     file.write("ply\n");
///     file.commit();
///
/// Every failure is an Error that names the target: a full disk and a file size limit too (SIGXFSZ
/// is held back), of which some surface only in `commit()`. Not thread-safe.
class AtomicFile {
 public:
  /// Throws: Error if `target` exists and `replace` is false, if it exists and is no regular file,
  /// or if its folder cannot be written.
  explicit AtomicFile(const std::filesystem::path& target, bool replace = false);
  ~AtomicFile();
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) noexcept;

  /// Appends; buffered, so small pieces are cheap.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);
  /// Replaces bytes from `offset` on, or adds after the end (a gap reads as zeros). The place of
  /// `write` stays the end of the file.
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Reads back what was written; returns the number of bytes, fewer only at the end of the file.
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> bytes);
  /// Bytes so far.
  [[nodiscard]] std::uint64_t size() const;

  /// Publishes the file; the object then only remembers its name. Without `replace` a file that has
  /// appeared under the name meanwhile is kept, and that is an Error.
  void commit();

  [[nodiscard]] const std::filesystem::path& target() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::stream
