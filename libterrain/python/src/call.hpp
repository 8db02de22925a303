// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <functional>
#include <stop_token>
#include <thread>
#include <type_traits>
#include <utility>

#include <terrace/stream/error.hpp>
#include <terrace/terrain/context.hpp>

#include "core.hpp"

namespace terrace::python {

/// Runs work on a thread of its own without the interpreter's lock, while this thread looks for
/// signals; one that raises, as Ctrl-C does, requests `stop` and is raised once the work has ended.
void run_apart(const std::function<void()>& work, std::stop_source& stop);

/// The same for work() or work(stop token); what takes no token is not stopped, and Ctrl-C is
/// raised when it has ended.
template <class Work>
auto released(Work&& work) {
  std::stop_source stop;
  const auto call = [&] {
    if constexpr (std::is_invocable_v<Work, std::stop_token>) {
      return work(stop.get_token());
    } else {
      return work();
    }
  };
  using Result = std::invoke_result_t<decltype(call)>;
  if constexpr (std::is_void_v<Result>) {
    run_apart(call, stop);
  } else {
    Result result;
    run_apart([&] { result = call(); }, stop);
    return result;
  }
}

/// What ends the work of a library that takes a check, once `stop` is requested.
inline std::function<void()> stop_check(const std::stop_token& stop) {
  return [stop] {
    if (stop.stop_requested()) throw stream::Stopped();
  };
}

/// A number of threads, 0 for one per core.
inline unsigned all_or(unsigned threads) {
  return threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
}

/// A job of libterrain's: its context from Python's objects.
class Job {
 public:
  /// how: (progress, note, threads, memory). progress: None, or called as progress(what, count,
  /// fraction, ended) from time to time; what it raises ends the job. note: None, or called with
  /// lines of text. threads: 0 for one per core; memory: bytes, 0 for the library's own choice.
  explicit Job(const py::tuple& how);
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// work(context)
  template <class Work>
  auto run(Work&& work) {
    using Result = std::invoke_result_t<Work, const terrain::Context&>;
    if constexpr (std::is_void_v<Result>) {
      run_here([&] { work(context_); });
    } else {
      Result result;
      run_here([&] { result = work(context_); });
      return result;
    }
  }

 private:
  void run_here(const std::function<void()>& work);
  /// Calls Python from a working thread.
  void call_python(const std::function<void()>& call);

  py::object progress_, note_;
  terrain::Context context_;
  std::stop_source stop_;
  std::exception_ptr raised_;  ///< by progress or note
  double last_report_ = 0;
  std::uint64_t last_count_ = 0;  ///< and
  double last_fraction_ = 0;      ///< of the piece of work that goes on
};

}  // namespace terrace::python
