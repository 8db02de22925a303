// SPDX-License-Identifier: Apache-2.0
#include "io/spool.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "io/file_size_signal.hpp"
#include "io/output_placement.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Opens a file without a name. If the file system does not support that, creates a named file and
/// removes the name.
int open_nameless(std::filesystem::path folder) {
  if (folder.empty()) {
    std::error_code error;
    folder = std::filesystem::temp_directory_path(error);
    if (error) folder = "/tmp";
  }
  const int nameless = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC | O_EXCL, 0600);
  if (nameless >= 0) return nameless;
  std::string name = (folder / "terrace-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

Spool::Spool(std::string name, const std::filesystem::path& folder)
    : name_(std::move(name)),
      remedy_(folder.empty() ? "make room, or name another folder for temporary files: TMPDIR"
                             : "make room in " + folder.string()),
      descriptor_(open_nameless(folder)) {
  if (descriptor_ < 0) throw system_error(name_, "cannot open a temporary file", errno, remedy_);
}

Spool::~Spool() { ::close(descriptor_); }

void Spool::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  const FileSizeSignalBlock no_signal;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t put = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done,
                                 static_cast<off_t>(offset + done));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) {
      throw system_error(name_, "cannot write a temporary file", errno,
                         errno == EFBIG ? remedy_for(EFBIG) : remedy_);
    }
    done += static_cast<std::size_t>(put);
  }
  const std::uint64_t end = offset + bytes.size();
  std::uint64_t size = size_;
  while (size < end && !size_.compare_exchange_weak(size, end)) {
  }
}

void Spool::read(std::uint64_t offset, std::span<std::byte> out) const {
  assert(offset + out.size() <= size_);
  for (std::size_t done = 0; done < out.size();) {
    const ssize_t got = ::pread(descriptor_, out.data() + done, out.size() - done,
                                static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw system_error(name_, "cannot read a temporary file", got < 0 ? errno : EIO);
    done += static_cast<std::size_t>(got);
  }
}

}  // namespace terrace::stream
