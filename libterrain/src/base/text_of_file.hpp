// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

namespace terrace::terrain {

/// What a file holds; nothing if it cannot be opened or is a folder, of which a stream of the
/// standard library throws at the first byte.
inline std::optional<std::string> text_of_file(const std::string& name) {
  std::error_code ignored;
  const std::ifstream file(name, std::ios::binary);
  if (!file || std::filesystem::is_directory(name, ignored)) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

}  // namespace terrace::terrain
