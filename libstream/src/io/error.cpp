// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/error.hpp"

#include <system_error>
#include <utility>

namespace terrace::stream {
namespace {

std::string one_line(const Error::Parts& parts) {
  std::string line = parts.file;
  for (const std::string* part : {&parts.where, &parts.cause}) {
    if (part->empty()) continue;
    if (!line.empty()) line += ": ";
    line += *part;
  }
  if (!parts.remedy.empty()) line += "; " + parts.remedy;
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return line;
}

}  // namespace

Error::Error(Parts parts) : std::runtime_error(one_line(parts)), parts_(std::move(parts)) {}

ClosedPipe::ClosedPipe()
    : Error({.file = "standard output", .cause = "the program that reads it has ended"}) {}

Error system_error(std::string file, const std::string& action, int error_number,
                   std::string remedy) {
  return Error({.file = std::move(file),
                .cause = action + ": " + std::generic_category().message(error_number),
                .remedy = std::move(remedy),
                .error_number = error_number});
}

}  // namespace terrace::stream
