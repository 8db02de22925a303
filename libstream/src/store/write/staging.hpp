// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "terrace/stream/file_lock.hpp"

namespace terrace::stream::store {

/// The folder in which a store is written before it has its name (temporary.hpp). It is removed in
/// any case unless published.
class Staging {
 public:
  /// Cleans up after dead writers of the same store, then makes a folder. `target` may be a link:
  /// the store is or will be where it leads. Throws: Error.
  explicit Staging(std::filesystem::path target);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const std::filesystem::path& target() const { return target_; }
  /// Syncs the folder and gives it its name. With `replace`, whatever has the name is removed once
  /// the new store is in place. If two names cannot be exchanged in one step, no store has the name
  /// for a moment; if the process dies then, Store::open() and the next writer restore the old
  /// one's name. Throws: Error; the target is then unchanged.
  void publish(bool replace);

 private:
  std::filesystem::path target_;  ///< after following symbolic links
  std::filesystem::path folder_;  ///< empty once published
  FileLock lock_;
};

}  // namespace terrace::stream::store
