// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace terrace::terrain {

/// An option or value that is invalid for any data. (Faults in data are a stream::Error.)
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace terrace::terrain
