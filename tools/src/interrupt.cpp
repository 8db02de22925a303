// SPDX-License-Identifier: GPL-3.0-or-later
#include "interrupt.hpp"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <thread>
#include <utility>

#include <poll.h>
#include <unistd.h>

namespace terrace::tools {
namespace {

constexpr const char* kStopped = "interrupted; run the same command again to start anew";

volatile std::sig_atomic_t stop_requested = 0;

extern "C" void on_stop_signal(int signal) {
  // A second Ctrl-C means it: the default action ends the process.
  if (stop_requested != 0) {
    std::signal(signal, SIG_DFL);
    ::raise(signal);
  }
  stop_requested = 1;
  // A read that waits for a terminal or a pipe is tried again after a signal; now it fails.
  ::close(STDIN_FILENO);
}

}  // namespace

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  sigemptyset(&action.sa_mask);
  // No SA_RESTART: a read that waits for a terminal or a pipe must come back.
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  // Beyond a file size limit, writes shall fail with an error that can be told to the user.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() noexcept { return stop_requested != 0; }

void check_interrupt() {
  if (interrupted()) throw Interrupted(kStopped);
}

void run_interruptible(const std::function<void()>& work) {
  std::packaged_task<void()> task(work);
  std::future<void> done = task.get_future();
  std::thread worker(std::move(task));
  using namespace std::chrono_literals;
  while (done.wait_for(50ms) != std::future_status::ready) {
    if (!interrupted() || done.wait_for(1s) == std::future_status::ready) continue;
    std::fprintf(stderr, "terrace: %s\n", kStopped);
    // Not exit(): the worker would go on beneath the destructors.
    std::_Exit(130);
  }
  worker.join();
  done.get();
}

bool stdout_closed() noexcept {
  pollfd out{.fd = STDOUT_FILENO, .events = 0, .revents = 0};
  return ::poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
}

}  // namespace terrace::tools
