// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace terrace::stream {

/// A format that is not read here but is common where points, rasters and meshes come from.
struct ForeignFormat {
  std::string_view name;    ///< with what it is, to stand behind "is"
  std::string_view remedy;  ///< what turns a file of it into one that can be read
};

/// The format that the first bytes of a file (4,096 or all) tell; nullptr if none.
const ForeignFormat* foreign_format_of_content(std::string_view head);
/// The format that an ending tells: ".laz", in lower case; nullptr if none.
const ForeignFormat* foreign_format_of_ending(std::string_view ending);

}  // namespace terrace::stream
