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

/// Runs work on another thread without the interpreter's lock, while this thread checks for
/// signals. A signal that raises an exception, such as Ctrl-C, requests `stop`; the exception is
/// raised when the work has ended.
void run_apart(const std::function<void()>& work, std::stop_source& stop);

/// Returns work() or work(stop token), run as by run_apart(). Work without a token runs to its end
/// before Ctrl-C is raised.
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

/// Returns a check for the libraries that ends their work once `stop` is requested.
inline std::function<void()> stop_check(const std::stop_token& stop) {
  return [stop] {
    if (stop.stop_requested()) throw stream::Stopped();
  };
}

/// Returns the number of threads, or one per core for 0.
inline unsigned all_or(unsigned threads) {
  return threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
}

/// A libterrain call whose context comes from Python objects.
class Call {
 public:
  /// settings: (progress, note, threads, memory). progress: None, or called repeatedly as
  /// progress(what, count, fraction, ended); an exception from it ends the work. note: None, or
  /// called with lines of text. threads: 0 for one per core. memory: in bytes, 0 for the library's
  /// default.
  explicit Call(const py::tuple& settings);
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// Returns work(context).
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
  /// Calls Python from a worker thread.
  void call_python(const std::function<void()>& call);

  py::object progress_, note_;
  terrain::Context context_;
  std::stop_source stop_;
  std::exception_ptr raised_;  ///< from progress or note
  double last_report_ = 0;
  std::uint64_t last_count_ = 0;  ///< of the current piece of work
  double last_fraction_ = 0;      ///< likewise
};

}  // namespace terrace::python
