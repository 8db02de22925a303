// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "terrace/stream/atomic_file.hpp"

namespace terrace::tools {

/// Text on its way to a file, whole or not at all, or to standard output ("-").
class TextOutput {
 public:
  /// Throws: as stream::AtomicFile.
  TextOutput(const std::string& path, bool replace);
  /// Throws: stream::Error if it cannot be written.
  void write(std::string_view text);
  /// Publishes the file.
  void finish();

 private:
  std::optional<stream::AtomicFile> file_;
};

}  // namespace terrace::tools
