// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace terrace::stream {

/// Limits of JSON from a file.
struct JsonLimits {
  int depth = 16;                             ///< maximum depth of nested lists and objects
  std::size_t values = std::size_t{1} << 20;  ///< values, names and brackets
};

/// Parses JSON in time linear in its bytes. (nlohmann's parser with a callback walks a whole list
/// at the end of each of its objects.) refuse: called with the cause if a limit is exceeded, and
/// must throw. Throws: nlohmann::json::parse_error, and out_of_range for a number too large for a
/// double.
nlohmann::json parse_bounded_json(std::string_view text, const JsonLimits& limits,
                                  const std::function<void(const char* cause)>& refuse);

}  // namespace terrace::stream
