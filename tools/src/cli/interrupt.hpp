// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <stop_token>
#include <string>

#include <terrace/stream/store.hpp>

namespace terrace::tools {

/// Thrown where work stops because of Ctrl-C. what() says how to go on.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// From here on SIGINT and SIGTERM only ask to stop (the second one ends the process at once), and
/// a closed pipe is an error of the write instead of a signal.
void install_signal_handlers();

/// True once the user has asked to stop. Cheap; may be called from any thread.
[[nodiscard]] bool interrupted() noexcept;

/// Throws Interrupted if the user has asked to stop. Loops call it once per block.
void check_interrupt();

/// A store whose reading ends by it, with stream::Stopped. Throws: as stream::Store::open.
[[nodiscard]] stream::Store open_store(const std::filesystem::path& path);

/// The same request for what waits: reading and writing pipes ends with stream::Stopped.
[[nodiscard]] std::stop_token stop_token();

/// Calls `work` on a thread of its own and returns when it is done; what it throws comes out. If
/// the user asks to stop and the work does not end by itself within a second (it calls
/// check_interrupt() now and then, or it does not), the process ends here with a message and exit
/// code 130. So `work` must not be writing anything.
void run_interruptible(const std::function<void()>& work);

}  // namespace terrace::tools
