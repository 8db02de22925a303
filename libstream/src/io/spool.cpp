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
  for (std::size_t position = 0; position < bytes.size();) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data() + position, bytes.size() - position,
                                     static_cast<off_t>(offset + position));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      throw system_error(name_, "cannot write a temporary file", errno,
                         errno == EFBIG ? remedy_for(EFBIG) : remedy_);
    }
    position += static_cast<std::size_t>(written);
  }
  const std::uint64_t end = offset + bytes.size();
  std::uint64_t size = size_;
  while (size < end && !size_.compare_exchange_weak(size, end)) {
  }
}

void Spool::read(std::uint64_t offset, std::span<std::byte> out) const {
  assert(offset + out.size() <= size_);
  for (std::size_t position = 0; position < out.size();) {
    const ssize_t count = ::pread(descriptor_, out.data() + position, out.size() - position,
                                  static_cast<off_t>(offset + position));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0)
      throw system_error(name_, "cannot read a temporary file", count < 0 ? errno : EIO);
    position += static_cast<std::size_t>(count);
  }
}

}  // namespace terrace::stream
