// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

/// GDAL's command line tools, the oracle for the meaning of a GeoTIFF.

namespace terrace::stream {

/// True if GDAL's command line tools are installed.
inline bool has_gdal() {
  static const bool is_installed = std::system("command -v gdalinfo >/dev/null 2>&1") == 0;
  return is_installed;
}

/// Runs a command. Returns its standard output, or an empty string if it cannot be run.
inline std::string output_of(const std::string& command) {
  std::string text;
  FILE* const pipe = popen((command + " 2>/dev/null").c_str(), "r");
  if (pipe == nullptr) return text;
  std::array<char, 4096> buffer{};
  std::size_t n = 0;
  while ((n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0) text.append(buffer.data(), n);
  pclose(pipe);
  return text;
}

/// Returns the output of `gdalinfo -json` as JSON. It is discarded() if the command fails.
inline nlohmann::json gdalinfo(const std::string& file, const std::string& options = {}) {
  return nlohmann::json::parse(output_of("gdalinfo -json " + options + " '" + file + "'"), nullptr,
                               false);
}

}  // namespace terrace::stream
