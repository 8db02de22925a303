// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace terrace::stream {

/// A format that is not supported but common for points, rasters and meshes.
struct ForeignFormat {
  std::string_view name;    ///< with a description, to follow "is"
  std::string_view remedy;  ///< how to convert such a file into a readable one
};

/// The format recognised by the first bytes of a file (4,096 or all); nullptr if none.
const ForeignFormat* foreign_format_of_content(std::string_view head);
/// The format of an ending in lower case such as ".laz"; nullptr if none.
const ForeignFormat* foreign_format_of_ending(std::string_view ending);

}  // namespace terrace::stream
