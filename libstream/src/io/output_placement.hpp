// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {

/// A complete and synced output, file or folder. It has a temporary name in the folder of its final
/// name.
class OutputPlacement {
 public:
  OutputPlacement() = default;
  /// shown: the output's name in messages. `place` does not end in a link.
  OutputPlacement(std::filesystem::path shown, std::filesystem::path place,
                  std::filesystem::path temporary, Naming naming);

  [[nodiscard]] const std::filesystem::path& place() const { return place_; }
  [[nodiscard]] const std::filesystem::path& shown() const { return shown_; }
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }

  /// Renames and keeps the replaced output. Throws: Error, and then nothing has changed.
  void publish();
  /// Restores the replaced output; the new one has its temporary name again.
  void undo() noexcept;
  /// Where the old output is after publish(); empty if there was none.
  [[nodiscard]] std::filesystem::path replaced() const;
  [[nodiscard]] bool done() const { return state_ != State::pending; }

 private:
  enum class State : std::uint8_t {
    pending,
    created,    ///< nothing has been replaced
    exchanged,  ///< the old output has the temporary name
    backed_up,  ///< the old output has the temporary name with kReplacedEnding
    lost,       ///< the old output could not be kept
  };

  [[nodiscard]] std::filesystem::path backup_path() const;
  [[nodiscard]] Ownership ownership_of(const std::filesystem::path& old) const noexcept;
  bool publish_by_exchange();
  bool publish_by_renames();
  [[nodiscard]] Error failed(int error_number) const;
  std::filesystem::path shown_, place_, temporary_;
  Naming naming_;
  State state_ = State::pending;
};

/// Publishes all outputs and syncs their folders. Throws: Error; every name then refers to what it
/// did before.
void publish_all(std::span<OutputPlacement* const> outputs);

/// Returns the Error for an output that may not replace the existing file or folder of its name.
Error already_exists(std::string file);

/// Returns the remedy for an error of a system call that creates or writes a file; empty if none is
/// known.
std::string remedy_for(int error_number);

/// Syncs a folder. Does nothing if the folder cannot be read, or if its file system does not
/// support the sync. Throws: Error.
void sync_folder(const std::filesystem::path& folder);

}  // namespace terrace::stream
