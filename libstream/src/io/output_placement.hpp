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

/// A complete and synced output, file or folder, under a temporary name in the folder of the name
/// that it is to get.
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
  void put();
  /// Restores the replaced output; the new one has its temporary name again.
  void undo() noexcept;
  /// Where the old output is after put(); empty if there was none.
  [[nodiscard]] std::filesystem::path replaced() const;
  [[nodiscard]] bool done() const { return state_ != State::waiting; }

 private:
  enum class State : std::uint8_t {
    waiting,
    alone,      ///< nothing has been replaced
    exchanged,  ///< the old output has the temporary name
    aside,      ///< the old output has the temporary name with kReplacedEnding
    gone,       ///< the old output could not be kept
  };

  [[nodiscard]] std::filesystem::path aside() const;
  [[nodiscard]] Ownership ownership_of(const std::filesystem::path& old) const noexcept;
  bool put_by_exchange();
  bool put_by_steps();
  [[nodiscard]] Error failed(int error_number) const;
  std::filesystem::path shown_, place_, temporary_;
  Naming naming_;
  State state_ = State::waiting;
};

/// Gives all of them their names and syncs their folders. Throws: Error; then all names have what
/// they had before.
void put_together(std::span<OutputPlacement* const> outputs);

/// Returns the Error for an output that may not replace what has its name.
Error already_exists(std::string file);

/// The remedy for an error of a system call that creates or writes a file; empty if none is known.
std::string remedy_for(int error_number);

/// fsync of a folder that may be read; one that cannot be synced by its file system counts as
/// synced. Throws: Error.
void sync_folder(const std::filesystem::path& folder);

}  // namespace terrace::stream
