// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>

#include <sys/mman.h>
#include <unistd.h>

/// The common parts of this library's and the command's fuzz targets. A target is one file with one
/// function, accepts(). fuzz_main.cpp passes it to libFuzzer, and replay_main.cpp runs it over a
/// corpus.

namespace terrace::terrain::fuzz {

/// Reads any bytes. Returns true if they were read to the end and are valid, false if they were
/// refused as bad input. Aborts the process if an invariant is violated.
bool accepts(const std::uint8_t* data, std::size_t size);

/// Aborts if an invariant is violated, also in release builds.
inline void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "invariant violated: %s\n", what);
  std::abort();
}

/// Aborts if the work grows faster than the size of the input: if it takes more than two seconds of
/// processor time plus ten microseconds per byte, a hundred times what parsers need.
class WorkLimit {
 public:
  explicit WorkLimit(std::uint64_t bytes) : items_(bytes) {}
  ~WorkLimit() {
    const double seconds = static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC;
    require(seconds <= 2 + 1e-5 * static_cast<double>(items_), "time in proportion to the input");
  }
  WorkLimit(const WorkLimit&) = delete;
  WorkLimit& operator=(const WorkLimit&) = delete;

 private:
  std::uint64_t items_;
  std::clock_t begin_ = std::clock();
};

/// A file in memory with the given bytes, so that a reader opens it like any other.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : file_(memfd_create("fuzz", 0)) {
    require(file_ >= 0 &&
                write(file_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
            "a file in memory");
    name_ = "/proc/self/fd/" + std::to_string(file_);
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  int file_;
  std::string name_;
};

/// A folder that is removed at the end of the process.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "terrace-fuzz-XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr, "a scratch folder");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Removes the first line from `text` and returns it, without its end.
inline std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

}  // namespace terrace::terrain::fuzz
