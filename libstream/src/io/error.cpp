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

Error::Error(std::string file, std::string cause)
    : Error({.file = std::move(file), .cause = std::move(cause)}) {}
Error::Error(Parts parts) : std::runtime_error(one_line(parts)), parts_(std::move(parts)) {}

Error Error::at(std::string where) && {
  parts_.where = std::move(where);
  return Error(std::move(parts_));
}

Error Error::at_byte(std::uint64_t offset) && {
  return std::move(*this).at("byte " + std::to_string(offset));
}

Error Error::at_line(std::uint64_t number) && {
  return std::move(*this).at("line " + std::to_string(number));
}

Error Error::remedy(std::string remedy) && {
  parts_.remedy = std::move(remedy);
  return Error(std::move(parts_));
}

Error Error::error_number(int number) && {
  parts_.error_number = number;
  return Error(std::move(parts_));
}

ClosedPipe::ClosedPipe() : Error("standard output", "the program that reads it has ended") {}

Error system_error(std::string file, const std::string& action, int error_number,
                   std::string remedy) {
  return Error(std::move(file), action + ": " + std::generic_category().message(error_number))
      .remedy(std::move(remedy))
      .error_number(error_number);
}

}  // namespace terrace::stream
