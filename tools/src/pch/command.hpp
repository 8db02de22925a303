// SPDX-License-Identifier: GPL-3.0-or-later
// The command's slowest headers, compiled once.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
