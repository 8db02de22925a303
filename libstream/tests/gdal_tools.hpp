// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

namespace terrace::stream {

/// GDAL's command line tools, if installed, are the oracle for the meaning of a GeoTIFF.
inline bool has_gdal() {
  static const bool found = std::system("command -v gdalinfo >/dev/null 2>&1") == 0;
  return found;
}

/// Returns the output of a command.
inline std::string output_of(const std::string& command) {
  std::string text;
  FILE* const pipe = popen((command + " 2>/dev/null").c_str(), "r");
  if (pipe == nullptr) return text;
  std::array<char, 4096> piece{};
  std::size_t n = 0;
  while ((n = std::fread(piece.data(), 1, piece.size(), pipe)) > 0) text.append(piece.data(), n);
  pclose(pipe);
  return text;
}

/// `gdalinfo -json` of a file.
inline nlohmann::json gdalinfo(const std::string& file, const std::string& options = {}) {
  return nlohmann::json::parse(output_of("gdalinfo -json " + options + " '" + file + "'"), nullptr,
                               false);
}

}  // namespace terrace::stream
