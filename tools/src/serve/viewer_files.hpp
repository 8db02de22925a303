// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>

namespace terrace::tools {

/// A file of the viewer (viewer/dist), embedded in the command.
struct ViewerFile {
  std::string_view name;
  std::string_view bytes;
};

std::span<const ViewerFile> viewer_files();

}  // namespace terrace::tools
