// SPDX-License-Identifier: Apache-2.0
#include "io/stop_waiter.hpp"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {

StopWaiter::StopWaiter(const std::stop_token& stop) : stop_(stop) {
  if (!stop.stop_possible()) return;
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) {
    throw system_error({}, "cannot create a pipe", errno, "close files or raise ulimit -n");
  }
  read_end_ = ends[0];
  write_end_ = ends[1];
  for (const int end : ends) ::fcntl(end, F_SETFD, FD_CLOEXEC);
  on_stop_.emplace(stop, [this] {
    const char byte = 0;
    [[maybe_unused]] const ssize_t written = ::write(write_end_, &byte, 1);
  });
}

StopWaiter::~StopWaiter() {
  on_stop_.reset();
  if (read_end_ < 0) return;
  ::close(read_end_);
  ::close(write_end_);
}

void StopWaiter::wait(int descriptor, short events) const {
  for (;;) {
    if (stop_.stop_requested()) throw Stopped();
    std::array<pollfd, 2> waiting{};
    waiting[0] = {.fd = descriptor, .events = events, .revents = 0};
    waiting[1] = {.fd = read_end_, .events = POLLIN, .revents = 0};  // ignored if negative
    const int ready = ::poll(waiting.data(), waiting.size(), -1);
    if (stop_.stop_requested()) throw Stopped();
    // If poll fails for a reason other than a signal, the following read reports the cause.
    if (ready < 0 && errno != EINTR) return;
    if (waiting[0].revents != 0) return;
  }
}

}  // namespace terrace::stream
