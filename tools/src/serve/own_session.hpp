// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace terrace::tools {

/// Returns whether the program at the other end of a connection over 127.0.0.1 belongs to this
/// process's user and session, like a command typed in the same terminal. Returns false if the
/// system does not say. `address` is that of the other end, as in sockaddr_in; ports are in host
/// byte order.
bool is_of_this_session(std::uint32_t address, std::uint16_t client_port,
                        std::uint16_t server_port);

}  // namespace terrace::tools
