// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/interrupt.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <new>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <unistd.h>

#include "cli/terminal.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

/// Atomic because other threads read it; std::sig_atomic_t would only suit the handler's own
/// thread.
std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);
/// Pipe from the signal handler to a thread, which may call functions that a handler must not call.
std::array<int, 2> wake_pipe{-1, -1};

extern "C" void on_stop_signal(int signal) {
  // A second Ctrl-C takes the default action, which ends the process.
  if (stop_requested.exchange(true)) {
    std::signal(signal, SIG_DFL);
    ::raise(signal);
  }
  const int error = errno;
  const char byte = 0;
  [[maybe_unused]] const ssize_t written = ::write(wake_pipe[1], &byte, 1);
  errno = error;
}

/// How long work may continue after a stop request.
constexpr std::chrono::seconds kGrace{2};

/// Forwards signals to `stop`, and ends the process if the work does not end within kGrace, for
/// example in the middle of a large triangulation. That is as safe as killing it, because no
/// partial file has its final name yet. If the thread cannot be started, only loops that poll the
/// flag end.
void watch_for_signals(const std::stop_source& stop) {
  if (wake_pipe[0] < 0) return;
  // Block signals in this thread, so that they interrupt system calls of the others.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    std::thread([stop]() mutable {
      char byte = 0;
      while (::read(wake_pipe[0], &byte, 1) < 0 && errno == EINTR) {
      }
      stop.request_stop();
      std::this_thread::sleep_for(kGrace);
      print_message(kStopped);
      // Not exit(): other threads would keep running during the destructors.
      std::_Exit(130);
    }).detach();
  } catch (const std::system_error&) {
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace

void install_signal_handlers() {
  if (::pipe(wake_pipe.data()) == 0) {
    for (const int end : wake_pipe) ::fcntl(end, F_SETFD, FD_CLOEXEC);
  }
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  sigemptyset(&action.sa_mask);
  // No SA_RESTART: a read that waits for a terminal or a pipe must return.
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  // Beyond a file size limit, writes then fail with an error that can be reported.
  std::signal(SIGXFSZ, SIG_IGN);
  static_cast<void>(stop_token());  // starts watching for signals
}

bool interrupted() noexcept { return stop_requested; }

void check_interrupt() {
  if (interrupted()) throw stream::Stopped();
}

std::stop_token stop_token() {
  // Never destroyed: the thread that asks it to stop outlives main().
  static std::stop_source& source = *[] {
    auto* new_source = new std::stop_source;
    watch_for_signals(*new_source);
    return new_source;
  }();
  return source.get_token();
}

stream::Store open_store(const std::filesystem::path& path, const std::string& where) {
  return stream::Store::open(path).with_stop(stop_token()).where(where);
}

void call_library(const std::string& file, const std::string& method,
                  const std::function<void()>& work) {
  try {
    work();
  } catch (const std::invalid_argument& error) {
    throw stream::Error(file, error.what());
  } catch (const std::bad_alloc&) {
    throw stream::Error(file, "does not fit into memory with method " + method)
        .remedy("take fewer points, or another method");
  }
}

}  // namespace terrace::tools
