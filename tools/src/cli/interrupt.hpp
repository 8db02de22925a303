// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include <terrace/stream/store.hpp>

namespace terrace::tools {

/// What the user is told who has asked to stop.
inline constexpr const char* kStopped = "interrupted; run the same command again to start over";

/// From then on SIGINT and SIGTERM ask to stop, and a closed pipe is an error of the write instead
/// of a signal. Work that does not end within two seconds is cut short with exit code 130; a second
/// signal ends the process at once.
void install_signal_handlers();

/// True once the user has asked to stop. Cheap; may be called from any thread.
[[nodiscard]] bool interrupted() noexcept;

/// Throws stream::Stopped if the user has asked to stop. Loops call it once per block.
void check_interrupt();

/// A store whose reading throws stream::Stopped once the user has asked to stop, or the view of it
/// that --where asks for. Throws: as stream::Store::open and where.
[[nodiscard]] stream::Store open_store(const std::filesystem::path& path,
                                       const std::string& where = {});

/// The same request as a token: reading and writing pipes ends with stream::Stopped.
[[nodiscard]] std::stop_token stop_token();

/// Does work of a library on points in memory. Exceptions are rethrown, std::invalid_argument and
/// std::bad_alloc as a stream::Error that names the file.
void call_library(const std::string& file, const std::string& method,
                  const std::function<void()>& work);

}  // namespace terrace::tools
