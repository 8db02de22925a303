// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace terrace::tools {

/// Whether the program at the other end of a connection over 127.0.0.1 belongs to this process's
/// user and session, as a command typed in the same terminal does. False where the system does not
/// say. address: of that end, as in sockaddr_in; the ports are in the order of this machine.
bool is_of_this_session(std::uint32_t address, std::uint16_t client_port,
                        std::uint16_t server_port);

}  // namespace terrace::tools
