// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrace/stream/error.hpp"

/// Outputs that appear under their names complete and synced, or not at all.
///
/// An output is written and synced under a temporary name, then renamed, then its folder is synced.
/// What it replaces is kept until that has succeeded; if a step fails, the renames are undone. So
/// after an Error every name has what it had before, and without one the new output is on the disk.
/// A file system that says that it cannot sync folders, and a folder that may not be read, are not
/// errors.

namespace terrace::stream {

class OutputGroup;

/// Whether terrace wrote what has an output's name.
struct Ownership {
  Ownership(bool all) : ours(all) {}
  /// Of a folder that terrace wrote, with a file that it did not write: its path in the folder.
  static Ownership except(std::string file) {
    Ownership found(false);
    found.stranger = std::move(file);
    return found;
  }

  bool ours;
  std::string stranger{};
};

/// Of a folder that is ours if all its entries are, of which `of_entry` is asked. The stranger is
/// the first by name. False for a folder that cannot be listed.
Ownership ownership_of_entries(
    const std::filesystem::path& folder,
    const std::function<Ownership(const std::filesystem::directory_entry&)>& of_entry);

/// For an output whose name is taken by what terrace did not write, or not all of it. Requires
/// !found.ours.
Error not_replaced(std::string file, const Ownership& found);

/// How an output takes its name. Converts from bool: whether it may replace what has the name.
struct Naming {
  Naming() = default;
  template <std::same_as<bool> Bool>  // not from pointers, and so not from functions
  Naming(Bool replace_any) : replace(replace_any) {}
  Naming(std::function<Ownership(const std::filesystem::path&)> may_go)
      : replace(true), is_ours(std::move(may_go)) {}

  bool replace = false;
  /// Only what this accepts is replaced; empty: anything. Asked at the moment of replacement, of
  /// the very file or folder that has the name then, which may have a temporary name meanwhile.
  std::function<Ownership(const std::filesystem::path&)> is_ours{};
  /// Files only: the file gets its name by commit() of the group, which must outlive the writer.
  OutputGroup* group = nullptr;
  /// Files only: the name in messages if that is not the target's, as for a part of an output.
  std::filesystem::path shown{};
};

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
  /// Throws: Error if `target` exists and may not be replaced, if it exists and is not a regular
  /// file, or if its folder is not writable.
  explicit AtomicFile(const std::filesystem::path& target, Naming naming = {});
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

  /// Publishes the file, or syncs it and leaves that to its group; afterwards the object only has
  /// its name. A file that has appeared under the name meanwhile and may not be replaced is kept,
  /// and that is an Error.
  void commit();

  [[nodiscard]] const std::filesystem::path& target() const;

 private:
  friend class OutputGroup;
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Several files of one run that get their names together: all are new, or all are old. Only a
/// process that dies between two renames leaves some of both.
class OutputGroup {
 public:
  OutputGroup();
  /// Files that have not got their names are removed.
  ~OutputGroup();
  OutputGroup(const OutputGroup&) = delete;
  OutputGroup& operator=(const OutputGroup&) = delete;

  /// Gives all files whose commit() has been called their names. Throws: Error; every name then has
  /// what it had before.
  void commit();

 private:
  friend class AtomicFile;
  std::vector<std::shared_ptr<AtomicFile::Impl>> files_;
};

/// A folder that appears under its name complete and synced, or not at all.
///
/// The caller writes and syncs files in folder(), at last the one whose presence makes the folder
/// complete, the mark. `commit()` syncs the folders and renames; an object destroyed before that
/// removes the folder. A killed writer's folder is removed by the next writer of the same target.
/// Two names are exchanged in one step where the file system can do that; elsewhere nothing has the
/// name for a moment, and if the process dies then, the next writer restores the old folder's name.
class AtomicFolder {
 public:
  /// `target` may be a link: the folder is or will be where it leads. Throws: Error if that cannot
  /// be a folder's name or a folder cannot be made next to it. What exists is checked by commit().
  AtomicFolder(std::filesystem::path target, std::string mark, Naming naming = {});
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const;
  /// After following links.
  [[nodiscard]] const std::filesystem::path& target() const;
  /// Throws: Error; the target is then unchanged.
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether a writer of this library made the regular file at `path` and nothing has changed it
/// since. Commit() notes size and time of the file in its extended attribute "user.terrace"; a file
/// that has lost it (most copies do) and one on a file system without such attributes do not count.
[[nodiscard]] bool is_unchanged_output(const std::filesystem::path& path);

/// Removes temporary files left by killed writers of `target`, as the next AtomicFile for it would.
void remove_abandoned(const std::filesystem::path& target);

/// The path that a write to `path` reaches: symbolic links are followed, even to a path that does
/// not exist yet. Throws: Error if they form a cycle.
std::filesystem::path follow_links(std::filesystem::path path);

}  // namespace terrace::stream
