// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace terrace::stream {

/// Thrown for bad data and failed input or output, never for misuse (which asserts). `what()` is
/// one line: "FILE: WHERE: cause; remedy". Every part except file and cause may be empty.
class Error : public std::runtime_error {
 public:
  struct Parts {
    std::string file = {};    ///< the file as the caller named it
    std::string where = {};   ///< "line 12", "byte 4096", "tile 3,4", "cluster 0/17"
    std::string cause = {};   ///< what is wrong
    std::string remedy = {};  ///< what the user can do
    int error_number = 0;     ///< errno of the failed system call, if any; otherwise 0
  };

  explicit Error(Parts parts);

  [[nodiscard]] const Parts& parts() const noexcept { return parts_; }

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
                   std::string remedy = {});

}  // namespace terrace::stream
