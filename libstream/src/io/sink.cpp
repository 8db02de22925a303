// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/sink.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <climits>

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/stop_waiter.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kPendingBytes = 64u << 10;

/// True if a write may block until another program or a person reads.
bool may_wait(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return false;
  return S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode) || ::isatty(descriptor) != 0;
}

}  // namespace

Sink::Sink(const std::string& path, const Naming& replace, const std::stop_token& stop)
    : stop_(stop) {
  if (path != kStandardStream) {
    file_.emplace(path, replace);
  } else if (may_wait(STDOUT_FILENO)) {
    waiter_ = std::make_unique<StopWaiter>(stop);
  }
}

Sink::~Sink() = default;

void Sink::check_stop() const {
  if (stop_.stop_requested()) throw Stopped();
}

void Sink::write(std::string_view text) {
  check_stop();
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
  for (std::string_view rest = pending_; !rest.empty();) {
    // A pipe that is ready accepts this many bytes at once; a larger write could block.
    const std::size_t max_bytes = waiter_ ? PIPE_BUF : rest.size();
    if (waiter_) waiter_->wait(STDOUT_FILENO, POLLOUT);
    const ssize_t written = ::write(STDOUT_FILENO, rest.data(), std::min(rest.size(), max_bytes));
    if (written > 0) rest.remove_prefix(static_cast<std::size_t>(written));
    if (written >= 0 || errno == EINTR || errno == EAGAIN) continue;
    if (errno == EPIPE) throw ClosedPipe();
    if (errno == EBADF) {
      throw Error("standard output", "is closed").remedy("connect it to a file or a pipe");
    }
    throw system_error("standard output", "cannot write", errno);
  }
  pending_.clear();
}

void Sink::commit() {
  check_stop();
  if (file_) {
    file_->commit();
  } else {
    flush();
  }
}

}  // namespace terrace::stream
