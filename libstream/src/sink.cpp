// SPDX-License-Identifier: Apache-2.0
#include "sink.hpp"

#include <cassert>
#include <cerrno>

#include <unistd.h>

#include "input.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kPendingBytes = 64u << 10;

}  // namespace

Sink::Sink(const std::string& path, bool replace) {
  if (path != kStandardStream) file_.emplace(path, replace);
}

void Sink::write(std::string_view text) {
  size_ += text.size();
  if (file_) {
    file_->write(text);
    return;
  }
  pending_ += text;
  if (pending_.size() >= kPendingBytes) flush();
}

void Sink::write_at(std::uint64_t offset, std::string_view text) {
  assert(file_ && offset + text.size() <= size_);
  file_->write_at(offset, std::as_bytes(std::span(text)));
}

void Sink::flush() {
  for (std::string_view left = pending_; !left.empty();) {
    const ssize_t written = ::write(STDOUT_FILENO, left.data(), left.size());
    if (written < 0 && errno != EINTR) {
      throw system_error("standard output", "cannot write", errno);
    }
    if (written > 0) left.remove_prefix(static_cast<std::size_t>(written));
  }
  pending_.clear();
}

void Sink::commit() {
  if (file_) {
    file_->commit();
  } else {
    flush();
  }
}

}  // namespace terrace::stream
