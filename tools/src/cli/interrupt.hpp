// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include <terrace/stream/store.hpp>

namespace terrace::tools {

/// The message shown after the user asked to stop.
inline constexpr const char* kStopped = "interrupted; run the same command again to start over";

/// Installs the handlers: SIGINT and SIGTERM request a stop, and a closed pipe is a write error
/// rather than a signal. Work that does not end within two seconds of the request is cut short with
/// exit code 130. A second signal ends the process at once.
void install_signal_handlers();

/// Returns true once the user has asked to stop. Cheap; may be called from any thread.
[[nodiscard]] bool interrupted() noexcept;

/// Throws stream::Stopped if the user has asked to stop. Loops call it once per block.
void check_interrupt();

/// Opens a store, restricted to the points that satisfy `where` unless it is empty. Reading from it
/// throws stream::Stopped once the user has asked to stop. Throws what stream::Store::open() and
/// stream::Store::where() throw.
[[nodiscard]] stream::Store open_store(const std::filesystem::path& path,
                                       const std::string& where = {});

/// Returns a token for the stop request. Reads and writes of pipes that have it end with
/// stream::Stopped.
[[nodiscard]] std::stop_token stop_token();

/// Calls `work`, which runs a method of a library on the points of a file. Turns
/// std::invalid_argument and std::bad_alloc into a stream::Error that names the file, and lets
/// other exceptions pass.
void call_library(const std::string& file, const std::string& method,
                  const std::function<void()>& work);

}  // namespace terrace::tools
