// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "terrace/stream/message.hpp"

namespace terrace::stream {

/// Thrown for bad data and failed input or output, never for misuse (which asserts). `what()` is
/// one line: "FILE: WHERE: cause; remedy". An error begins with file and cause; what else is known
/// is added in the same expression:
///
///     throw Error(input.name(), "the file ends too early")
///         .at_byte(input.offset())
///         .remedy("download it again");
class Error : public std::runtime_error {
 public:
  struct Parts {
    std::string file = {};   ///< the file as the caller named it
    std::string where = {};  ///< "line 12", "byte 4096", "tile 3,4", "cluster 0/17"
    Message cause = {};      ///< what is wrong
    Message remedy = {};     ///< what the user can do
    int error_number = 0;    ///< errno of the failed system call, if any; otherwise 0
  };

  Error(std::string file, Message cause);
  explicit Error(Parts parts);

  /// Each returns the error with one more part, which replaces that of an earlier call.
  [[nodiscard]] Error at(std::string where) &&;
  [[nodiscard]] Error at_byte(std::uint64_t offset) &&;
  [[nodiscard]] Error at_line(std::uint64_t number) &&;
  [[nodiscard]] Error remedy(Message remedy) &&;
  [[nodiscard]] Error error_number(int number) &&;

  [[nodiscard]] const Parts& parts() const noexcept { return parts_; }
  /// Returns what() as a message, for an interface with its own names of parameters.
  [[nodiscard]] Message message() const;

 private:
  Parts parts_;
};

/// Thrown when reading or writing ends early because a stop was requested by the caller's token.
class Stopped : public std::runtime_error {
 public:
  Stopped() : std::runtime_error("stopped") {}
};

/// Thrown by a write to standard output whose reader is gone (EPIPE).
class ClosedPipe : public Error {
 public:
  ClosedPipe();
};

/// Returns the Error for a failed system call; its cause ends with the text of `error_number`
/// (errno).
Error system_error(std::string file, const std::string& action, int error_number,
                   Message remedy = {});

}  // namespace terrace::stream
