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
/// The file or folder that it replaces is kept until then; if a step fails, the renames are undone.
/// So after an Error every name refers to what it did before, and without one the new output is on
/// disk. A file system that cannot sync folders and a folder without read permission are not
/// errors.

namespace terrace::stream {

class OutputGroup;

/// Whether terrace wrote the file or folder that has an output's name.
struct Ownership {
  Ownership(bool all) : ours(all) {}
  /// For a folder that terrace wrote, except for one file: its path in the folder.
  static Ownership except(std::string file) {
    Ownership ownership(false);
    ownership.stranger = std::move(file);
    return ownership;
  }

  bool ours;
  std::string stranger{};
};

/// Ownership of a folder, which is ours if `of_entry` says so of all its entries. The stranger is
/// the first by name. False for a folder that cannot be listed.
Ownership ownership_of_entries(
    const std::filesystem::path& folder,
    const std::function<Ownership(const std::filesystem::directory_entry&)>& of_entry);

/// The error for an output whose name is taken by a file or folder that terrace did not write, or
/// not all of it. Requires !found.ours.
Error not_replaced(std::string file, const Ownership& found);

/// How an output takes its name, and which files or folders it may replace. Converts from bool:
/// true replaces anything.
struct Naming {
  Naming() = default;
  template <std::same_as<bool> Bool>  // not from pointers, and so not from functions
  Naming(Bool replace_any) : replace(replace_any) {}
  Naming(std::function<Ownership(const std::filesystem::path&)> may_go)
      : replace(true), is_ours(std::move(may_go)) {}

  bool replace = false;
  /// Returns whether a file or folder may be replaced; empty: any may. Called at the moment of
  /// replacement with the path of the existing one, which may have been moved to a temporary name
  /// by then.
  std::function<Ownership(const std::filesystem::path&)> is_ours{};
  /// Files only: the group's commit() gives the file its name. The group must outlive the writer.
  OutputGroup* group = nullptr;
  /// Files only: the name in messages if it differs from the target's, as for a part of an output.
  std::filesystem::path shown{};
};

/// A file that appears under its name complete and synced, or not at all.
///
/// Bytes go to a temporary file next to the target, `.NAME.tmp-PID`, which is locked while its
/// writer lives. `commit()` syncs it and renames it to the target; an object destroyed before that,
/// for example by an exception, removes it. The next writer of the same target removes the file of
/// a killed writer. Symbolic links are followed: the file that a link points to is created or
/// replaced, and the link stays.
///
///     AtomicFile file("out.ply");
///     file.write("ply\n");
///     file.commit();
///
/// Every failure throws an Error that names the target, including a full disk and a file size limit
/// (SIGXFSZ is blocked). Some are found only by `commit()`. Not thread-safe.
class AtomicFile {
 public:
  /// Throws: Error if `target` exists and may not be replaced, if it exists and is not a regular
  /// file, or if its folder is not writable.
  explicit AtomicFile(const std::filesystem::path& target, Naming naming = {});
  ~AtomicFile();
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) noexcept;

  /// Appends bytes. Writes are buffered, so small pieces are cheap.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);
  /// Overwrites bytes from `offset` on and extends the file if necessary; a gap reads as zeros.
  /// `write` still appends at the end of the file.
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Reads back written bytes. Returns how many, which is less than bytes.size() only at the end of
  /// the file.
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> bytes);
  /// Size in bytes so far.
  [[nodiscard]] std::uint64_t size() const;

  /// Publishes the file, or only syncs it if it belongs to a group, which publishes it. Afterwards
  /// only target() may be called. Throws: Error if another file has appeared under the name
  /// meanwhile and may not be replaced; that file is kept.
  void commit();

  [[nodiscard]] const std::filesystem::path& target() const;

 private:
  friend class OutputGroup;
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Several files of one run that are published together: all are new, or all are old. Only a
/// process that dies between two renames leaves a mixture.
class OutputGroup {
 public:
  OutputGroup();
  /// Removes the files that have not been published.
  ~OutputGroup();
  OutputGroup(const OutputGroup&) = delete;
  OutputGroup& operator=(const OutputGroup&) = delete;

  /// Publishes all files whose commit() has been called. Throws: Error; every name then refers to
  /// what it did before.
  void commit();

 private:
  friend class AtomicFile;
  std::vector<std::shared_ptr<AtomicFile::Impl>> files_;
};

/// A folder that appears under its name complete and synced, or not at all.
///
/// The caller writes and syncs files in folder(), and last the mark, the file whose presence says
/// that the folder is complete. `commit()` syncs the folders and renames; an object destroyed
/// before that removes the folder. The next writer of the same target removes the folder of a
/// killed writer. Old and new folder are exchanged in one step where the file system can do that.
/// Elsewhere the name does not exist for a moment; if the process dies then, the next writer
/// restores the old folder's name.
class AtomicFolder {
 public:
  /// `target` may be a link, which is followed. Throws: Error if it cannot be a folder's name, or
  /// if a folder cannot be created next to it. commit() checks what it would replace.
  AtomicFolder(std::filesystem::path target, std::string mark, Naming naming = {});
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const;
  /// The folder's path after following links.
  [[nodiscard]] const std::filesystem::path& target() const;
  /// Publishes the folder. Throws: Error; the target is then unchanged.
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// True if a writer of this library made the regular file at `path` and it has not changed since.
/// Commit() notes size and time of the file in its extended attribute "user.terrace". A file that
/// has lost the attribute, as most copies have, does not count, nor does one on a file system
/// without such attributes.
[[nodiscard]] bool is_unchanged_output(const std::filesystem::path& path);

/// Removes the temporary files of killed writers of `target`, as the next AtomicFile for it would.
void remove_abandoned(const std::filesystem::path& target);

/// Returns the path that a write to `path` creates or changes: follows symbolic links, even to a
/// path that does not exist yet. Throws: Error if they form a cycle.
std::filesystem::path follow_links(std::filesystem::path path);

}  // namespace terrace::stream
