// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "files.hpp"

namespace terrace::stream::store {

/// The folder in which a store is written before it has its name: `.terrace-HASH.tmp-PID` beside
/// it, with a locked file `.terrace-HASH.tmp-PID.lock` that tells living writers from dead ones. It
/// is gone, whatever happens, unless published.
class Staging {
 public:
  /// Removes what dead writers of the same store have left, then makes a folder.
  /// Throws: Error.
  explicit Staging(std::filesystem::path target);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const std::filesystem::path& target() const { return target_; }
  /// Syncs the folder and gives it its name. With `replace` what bears the name is taken away after
  /// the new one stands. Throws: Error; the target is then as it was.
  void publish(bool replace);

 private:
  void remove() noexcept;

  std::filesystem::path target_, parent_, folder_, lock_path_;
  Descriptor lock_;
  bool published_ = false;
};

}  // namespace terrace::stream::store
