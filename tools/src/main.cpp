// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/cli.hpp"
#include "cli/terminal.hpp"

int main(int argc, char** argv) {
  terrace::tools::secure_standard_descriptors();
  return terrace::tools::run_command_line(argc, argv);
}
