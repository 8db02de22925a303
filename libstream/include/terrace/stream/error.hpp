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
    std::string file;      ///< the file as the caller named it
    std::string where;     ///< "line 12", "byte 4096", "tile 3,4", "cluster 0/17"
    std::string cause;     ///< what is wrong
    std::string remedy;    ///< what the user can do
    int error_number = 0;  ///< errno of the system call that failed; 0: none did
  };

  explicit Error(Parts parts);

  [[nodiscard]] const Parts& parts() const noexcept { return parts_; }

 private:
  Parts parts_;
};

/// Thrown if reading or writing ends because the caller's stop token requested it.
class Stopped : public std::runtime_error {
 public:
  Stopped() : std::runtime_error("stopped") {}
};

/// Thrown by a write to standard output whose reader is gone (EPIPE).
class ClosedPipe : public Error {
 public:
  ClosedPipe();
};

/// An Error for a failed system call: the cause ends with the text of `error_number` (errno).
Error system_error(std::string file, const std::string& action, int error_number,
                   std::string remedy = {});

}  // namespace terrace::stream
