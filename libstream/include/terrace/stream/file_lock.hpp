// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace terrace::stream {

/// The exclusive right to something on disk: an flock() on a file of its own, which ends with its
/// holder, however that dies. The file goes when the lock is released; one that a killed holder has
/// left is taken over by the next.
class FileLock {
 public:
  /// Holds nothing.
  FileLock() = default;
  /// Makes the file if need be and locks it. `held()` is false if somebody else has it, in this
  /// process or another. Throws: Error if the file cannot be made.
  explicit FileLock(const std::filesystem::path& path);
  ~FileLock() { release(); }
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

  /// No other holds it. On file systems without locks (some network disks) nobody can tell, and
  /// work goes on.
  [[nodiscard]] bool held() const { return descriptor_ >= 0; }
  /// As held(), and the file system vouches for it.
  [[nodiscard]] bool exclusive() const { return held() && exclusive_; }
  /// Removes the file and lets go.
  void release() noexcept;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool exclusive_ = false, made_ = false;
};

}  // namespace terrace::stream
