// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/library_call.hpp"

#include <new>
#include <stdexcept>

#include "cli/interrupt.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {

void call_library(const std::string& file, const std::string& method,
                  const std::function<void()>& work) {
  try {
    run_interruptible(work);
  } catch (const std::invalid_argument& error) {
    throw stream::Error({.file = file, .where = {}, .cause = error.what(), .remedy = {}});
  } catch (const std::bad_alloc&) {
    throw stream::Error({.file = file,
                         .where = {},
                         .cause = "does not fit into memory with method " + method,
                         .remedy = "take fewer points, or another method"});
  }
}

}  // namespace terrace::tools
