// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace terrace::tools {

/// Returns a libterrain message with parameter names in backquotes (`memory_bytes`) replaced by the
/// options that set them (--memory). Other text in backquotes stays. O(length).
std::string with_option_names(std::string_view message);

}  // namespace terrace::tools
