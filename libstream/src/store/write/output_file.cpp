// SPDX-License-Identifier: Apache-2.0
#include "store/write/output_file.hpp"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "io/file_size_signal.hpp"
#include "io/output_placement.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

constexpr std::size_t kBufferSize = 1u << 18;

Error failed(const std::filesystem::path& path, const char* action) {
  const int number = errno;
  return system_error(path.string(), action, number, remedy_for(number));
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = other.release();
  }
  return *this;
}

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

OutputFile::OutputFile(std::filesystem::path path, std::filesystem::path shown)
    : path_(std::move(path)), shown_(std::move(shown)) {
  fd_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!fd_.open()) throw failed(shown_, "cannot be created");
  buffer_.reserve(kBufferSize);
}

void OutputFile::write(ByteView bytes) {
  checksum_ = crc32(checksum_, bytes.data(), bytes.size());
  size_ += bytes.size();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (buffer_.size() >= kBufferSize) flush();
}

void OutputFile::flush() {
  const FileSizeSignalBlock no_signal;
  const std::uint8_t* next = buffer_.data();
  std::size_t left = buffer_.size();
  while (left > 0) {
    const ssize_t written = ::write(fd_.get(), next, left);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw failed(shown_, "cannot be written");
    next += written;
    left -= static_cast<std::size_t>(written);
  }
#ifdef SYNC_FILE_RANGE_WRITE
  // Starts writing to disk while further blocks are encoded, so that finish() waits less. finish()
  // reports errors.
  static_cast<void>(::sync_file_range(fd_.get(), static_cast<off_t>(flushed_),
                                      static_cast<off_t>(buffer_.size()), SYNC_FILE_RANGE_WRITE));
#endif
  flushed_ += buffer_.size();
  buffer_.clear();
}

void OutputFile::finish() {
  flush();
  const FileSizeSignalBlock no_signal;
  if (::fsync(fd_.get()) != 0) throw failed(shown_, "cannot be synced");
  if (::close(fd_.release()) != 0) throw failed(shown_, "cannot be closed");
}

}  // namespace terrace::stream::store
