// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace terrace::stream {

/// Exclusive access to something on disk, by flock() on a separate file. The kernel releases the
/// lock when its holder dies. The file is removed when the lock is released; the next holder takes
/// over the file of a killed one.
class FileLock {
 public:
  /// Holds no lock.
  FileLock() = default;
  /// Creates the file if necessary and locks it. `held()` is false if the lock is already held, in
  /// this process or another. Throws: Error if the file cannot be created.
  explicit FileLock(const std::filesystem::path& path);
  ~FileLock() { release(); }
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

  /// Whether the lock is held. Also true on file systems without locks (some network disks), where
  /// exclusive access cannot be verified, so that work continues.
  [[nodiscard]] bool held() const { return descriptor_ >= 0; }
  /// Whether the lock is held and the file system guarantees it.
  [[nodiscard]] bool exclusive() const { return held() && exclusive_; }
  /// Whether the locked file still has its name; false if its folder has been moved or replaced.
  [[nodiscard]] bool has_name() const;
  /// Removes the file and releases the lock.
  void release() noexcept;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool exclusive_ = false, created_ = false;
};

}  // namespace terrace::stream
