// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace terrace::tools {

/// A message of libterrain for the user of the command: parameters, which the library names as its
/// interface does, in backquotes (`memory_bytes`), become the options that set them (--memory).
/// Other text in backquotes stays. O(length).
std::string with_option_names(std::string_view message);

}  // namespace terrace::tools
