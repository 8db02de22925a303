// SPDX-License-Identifier: GPL-3.0-or-later
// The slowest headers of the command, compiled once.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
