// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <utility>

#include <terrace/stream/message.hpp>

namespace terrace::terrain {

/// Reports an option or value that is invalid for any data. Faults in data are a stream::Error.
class UsageError : public std::runtime_error {
 public:
  explicit UsageError(stream::Message message)
      : std::runtime_error(message.text()), message_(std::move(message)) {}

  /// Returns what() as a message, for an interface with its own names of parameters.
  [[nodiscard]] const stream::Message& message() const noexcept { return message_; }

 private:
  stream::Message message_;
};

}  // namespace terrace::terrain
