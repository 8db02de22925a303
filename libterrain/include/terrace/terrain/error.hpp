// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace terrace::terrain {

/// An option or value that makes no sense, whatever the data is. (What is wrong with data is a
/// stream::Error.)
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace terrace::terrain
