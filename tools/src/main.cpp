// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli.hpp"

int main(int argc, char** argv) { return terrace::tools::run_command_line(argc, argv); }
