// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace terrace::terrain {

/// Wrong usage of the command: an option or value that makes no sense. Ends the command with exit
/// code 2. (What is wrong with data is a stream::Error and ends it with 1.)
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace terrace::terrain
