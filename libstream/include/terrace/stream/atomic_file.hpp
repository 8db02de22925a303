// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace terrace::stream {

/// A file that appears under its name complete and synced, or not at all.
///
/// Bytes go to a temporary file next to the target, `.NAME.tmp-PID`, which is locked while its
/// writer lives. `commit()` syncs it and renames it to the target; an object destroyed before that,
/// for example by an exception, removes it. A file left by a killed writer is removed by the next
/// writer of the same target. Symbolic links are followed as in any write: the file that a link
/// names is created or replaced, and the link stays.
///
///     AtomicFile file("out.ply");
///     file.write("ply\n");
///     file.commit();
///
/// Every failure is an Error that names the target, including a full disk and a file size limit
/// (SIGXFSZ is blocked); some appear only in `commit()`. Not thread-safe.
class AtomicFile {
 public:
  /// Throws: Error if `target` exists and `replace` is false, if it exists and is not a regular
  /// file, or if its folder is not writable.
  explicit AtomicFile(const std::filesystem::path& target, bool replace = false);
  ~AtomicFile();
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) noexcept;

  /// Appends; buffered, so small pieces are cheap.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);
  /// Replaces bytes from `offset` on, or adds after the end (a gap reads as zeros). `write` still
  /// appends at the end of the file.
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Reads back what was written; returns the number of bytes, fewer only at the end of the file.
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> bytes);
  /// Bytes so far.
  [[nodiscard]] std::uint64_t size() const;

  /// Publishes the file; afterwards the object only has its name. Without `replace`, a file that
  /// has appeared under the name meanwhile is kept, and that is an Error.
  void commit();

  [[nodiscard]] const std::filesystem::path& target() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Removes temporary files left by killed writers of `target`, as the next AtomicFile for it would.
void remove_abandoned(const std::filesystem::path& target);

/// The path that a write to `path` reaches: symbolic links are followed, even to a path that does
/// not exist yet. Throws: Error if they form a cycle.
std::filesystem::path follow_links(std::filesystem::path path);

}  // namespace terrace::stream
