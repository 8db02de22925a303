// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace terrace::stream {

/// Exclusive access to something on disk: an flock() on a separate file, which ends with its
/// holder, however that dies. The file is removed when the lock is released; one left by a killed
/// holder is taken over by the next.
class FileLock {
 public:
  /// Holds no lock.
  FileLock() = default;
  /// Creates the file if necessary and locks it. `held()` is false if another holder has it, in
  /// this process or another. Throws: Error if the file cannot be created.
  explicit FileLock(const std::filesystem::path& path);
  ~FileLock() { release(); }
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

  /// Whether the lock is held. On file systems without locks (some network disks) this is true
  /// although it cannot be verified, and work continues.
  [[nodiscard]] bool held() const { return descriptor_ >= 0; }
  /// As held(), and guaranteed by the file system.
  [[nodiscard]] bool exclusive() const { return held() && exclusive_; }
  /// Whether the locked file still has its name: not if its folder has been moved or replaced.
  [[nodiscard]] bool has_name() const;
  /// Removes the file and releases the lock.
  void release() noexcept;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool exclusive_ = false, made_ = false;
};

}  // namespace terrace::stream
