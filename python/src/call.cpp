// SPDX-License-Identifier: Apache-2.0
#include "call.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "names.hpp"

namespace terrace::python {
namespace {

double now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

}  // namespace

void run_apart(const std::function<void()>& work, std::stop_source& stop) {
  constexpr std::chrono::milliseconds kBetweenLooks{20};
  std::exception_ptr failed, raised;
  {
    const py::gil_scoped_release released;
    std::mutex mutex;
    std::condition_variable changed;
    bool ended = false;
    std::thread worker([&] {
      try {
        work();
      } catch (...) {
        failed = std::current_exception();
      }
      const std::lock_guard lock(mutex);
      ended = true;
      changed.notify_one();
    });
    std::unique_lock lock(mutex);
    while (!changed.wait_for(lock, kBetweenLooks, [&] { return ended; })) {
      if (raised) continue;
      lock.unlock();
      {
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0) {
          raised = std::make_exception_ptr(py::error_already_set());
          stop.request_stop();
        }
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (raised) std::rethrow_exception(raised);
  if (failed) std::rethrow_exception(failed);
}

Call::Call(const py::tuple& settings) : progress_(settings[0]), note_(settings[1]) {
  const auto threads = settings[2].cast<unsigned>();
  const auto memory = settings[3].cast<std::uint64_t>();
  context_.threads = all_or(threads);
  if (memory > 0) context_.memory_bytes = memory;
  context_.stop = stop_.get_token();
  if (!progress_.is_none()) {
    context_.progress = [this](const terrain::Progress& at) {
      constexpr double kBetweenReports = 0.05;
      const double time = now();
      // The last report of a piece of work may have no count.
      if (at.count > 0) last_count_ = at.count, last_fraction_ = at.fraction;
      if (!at.ended && time - last_report_ < kBetweenReports) return;
      last_report_ = time;
      call_python([&] {
        progress_(py::str(at.what.data(), at.what.size()), last_count_, last_fraction_, at.ended);
      });
      if (at.ended) last_count_ = 0, last_fraction_ = 0;
    };
  }
  if (!note_.is_none()) {
    context_.note = [this](const stream::Message& line) {
      call_python([&] { note_(message_of(line)); });
    };
  }
}

void Call::call_python(const std::function<void()>& call) {
  const py::gil_scoped_acquire gil;
  if (raised_) return;
  try {
    call();
  } catch (const py::error_already_set&) {
    raised_ = std::current_exception();
    stop_.request_stop();
  }
}

void Call::run_here(const std::function<void()>& work) {
  try {
    run_apart(work, stop_);
  } catch (...) {
    if (raised_) std::rethrow_exception(raised_);
    throw;
  }
  if (raised_) std::rethrow_exception(raised_);
}

}  // namespace terrace::python
