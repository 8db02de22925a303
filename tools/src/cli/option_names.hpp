// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <terrace/stream/message.hpp>

namespace terrace::tools {

/// Returns the text of a library's message with the options that set its parameters (--memory for
/// memory_bytes).
std::string option_text(const stream::Message& message);

}  // namespace terrace::tools
