// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/error.hpp"

#include <system_error>
#include <utility>

namespace terrace::stream {
namespace {

Message line_of(const Error::Parts& parts) {
  Message line = parts.file;
  for (const Message& part : {Message(parts.where), parts.cause}) {
    if (part.empty()) continue;
    if (!line.empty()) line += ": ";
    line += part;
  }
  if (!parts.remedy.empty()) line += "; " + parts.remedy;
  return std::move(line).on_one_line();
}

}  // namespace

Error::Error(std::string file, Message cause)
    : Error({.file = std::move(file), .cause = std::move(cause)}) {}
Error::Error(Parts parts) : std::runtime_error(line_of(parts).text()), parts_(std::move(parts)) {}

Message Error::message() const { return line_of(parts_); }

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

Error Error::remedy(Message remedy) && {
  parts_.remedy = std::move(remedy);
  return Error(std::move(parts_));
}

Error Error::error_number(int number) && {
  parts_.error_number = number;
  return Error(std::move(parts_));
}

ClosedPipe::ClosedPipe() : Error("standard output", "the program that reads it has ended") {}

Error system_error(std::string file, const std::string& action, int error_number, Message remedy) {
  return Error(std::move(file), action + ": " + std::generic_category().message(error_number))
      .remedy(std::move(remedy))
      .error_number(error_number);
}

}  // namespace terrace::stream
