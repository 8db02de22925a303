// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <system_error>
#include <thread>

#include <unistd.h>

namespace terrace::cluster {

/// Returns when every other thread of the process is waiting, or when `enough` returns true.
/// Subsequent work then finds the threads asleep, however loaded the machine is.
inline void wait_until_others_wait(const std::function<bool()>& enough = [] { return false; }) {
  namespace fs = std::filesystem;
  const std::string own = std::to_string(::gettid());
  const auto waits = [&](const fs::path& task) {
    std::ifstream file(task / "stat");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::size_t name_end = text.rfind(')');
    // A thread that has ended in the meantime has no text.
    return name_end == std::string::npos || text[name_end + 2] == 'S' || task.filename() == own;
  };
  for (bool all = false; !all && !enough(); std::this_thread::yield()) {
    all = true;
    std::error_code error;
    for (fs::directory_iterator task("/proc/self/task", error), end; !error && task != end;
         task.increment(error)) {
      all = all && waits(task->path());
    }
  }
}

}  // namespace terrace::cluster
