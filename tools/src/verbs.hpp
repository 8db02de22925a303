// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "cli.hpp"

namespace terrace::tools {

std::unique_ptr<Command> make_convert();
std::unique_ptr<Command> make_info();
std::unique_ptr<Command> make_render();
std::unique_ptr<Command> make_synth();

}  // namespace terrace::tools
