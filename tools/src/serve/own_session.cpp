// SPDX-License-Identifier: GPL-3.0-or-later
#include "serve/own_session.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/core.h>
#include <unistd.h>

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;

/// Returns an endpoint in the notation of /proc/net/tcp.
std::string end_text(std::uint32_t address, std::uint16_t port) {
  char text[16];
  std::snprintf(text, sizeof text, "%08X:%04X", address, port);
  return text;
}

/// Returns the number of the client's socket if it belongs to this user, otherwise an empty string.
std::string socket_of_client(const std::string& client, std::uint16_t server_port) {
  std::ifstream table("/proc/net/tcp");
  std::string line, skipped, local, remote, user, socket;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    fields >> skipped >> local >> remote;
    if (local != client || !remote.ends_with(end_text(0, server_port).substr(8))) continue;
    for (int i = 0; i < 4; ++i) fields >> skipped;  // state, queues, timer, retransmissions
    fields >> user >> skipped >> socket;
    return user == fmt::format("{}", ::geteuid()) && socket != "0" ? socket : std::string();
  }
  return {};
}

}  // namespace

bool is_of_this_session(std::uint32_t address, std::uint16_t client_port,
                        std::uint16_t server_port) {
  const std::string socket = socket_of_client(end_text(address, client_port), server_port);
  const pid_t session = ::getsid(0);
  if (socket.empty() || session <= 0) return false;
  const std::string link = "socket:[" + socket + "]";
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end;
       process.increment(error)) {
    const std::string name = process->path().filename().string();
    pid_t number = 0;
    const auto [last, fault] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (fault != std::errc() || last != name.data() + name.size()) continue;
    if (::getsid(number) != session) continue;
    std::error_code ended;
    for (fs::directory_iterator file(process->path() / "fd", ended), none; !ended && file != none;
         file.increment(ended)) {
      std::error_code closed;
      if (fs::read_symlink(file->path(), closed) == link) return true;
    }
  }
  return false;
}

}  // namespace terrace::tools
