// SPDX-License-Identifier: Apache-2.0
#include "store/files.hpp"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/file_size_signal.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

constexpr std::size_t kBufferSize = 1u << 18;

Error failed(const std::filesystem::path& path, const char* action) {
  const int number = errno;
  const bool full = number == ENOSPC || number == EFBIG || number == EDQUOT;
  return system_error(path.string(), action, number,
                      full ? "free some space or write elsewhere" : "");
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

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  fd_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!fd_.open()) throw failed(path_, "cannot create");
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
    if (written < 0) throw failed(path_, "cannot write");
    next += written;
    left -= static_cast<std::size_t>(written);
  }
  buffer_.clear();
}

void OutputFile::finish() {
  flush();
  const FileSizeSignalBlock no_signal;
  if (::fsync(fd_.get()) != 0) throw failed(path_, "cannot sync");
  if (::close(fd_.release()) != 0) throw failed(path_, "cannot close");
}

InputFile::InputFile(std::filesystem::path path, std::uint64_t size)
    : path_(std::move(path)), size_(size) {
  fd_ = Descriptor(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd_.open()) throw failed(path_, "cannot open");
  struct stat status {};
  if (::fstat(fd_.get(), &status) != 0) throw failed(path_, "cannot inspect");
  if (!S_ISREG(status.st_mode) || static_cast<std::uint64_t>(status.st_size) != size) {
    throw Error({.file = path_.string(),
                 .where = {},
                 .cause = "the manifest says " + std::to_string(size) + " bytes, the file has " +
                          std::to_string(status.st_size),
                 .remedy = "restore the file or build the store anew"});
  }
}

void InputFile::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t got =
        ::pread(fd_.get(), out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw failed(path_, "cannot read");
    if (got == 0) {
      throw Error({.file = path_.string(),
                   .where = "byte " + std::to_string(offset + done),
                   .cause = "the file ends too early",
                   .remedy = "restore the file or build the store anew"});
    }
    done += static_cast<std::size_t>(got);
  }
}

std::string read_whole(const std::filesystem::path& path, std::uint64_t most) {
  Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd.open()) throw failed(path, "cannot open");
  std::string text;
  char chunk[1 << 14];
  for (;;) {
    const ssize_t got = ::read(fd.get(), chunk, sizeof chunk);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw failed(path, "cannot read");
    if (got == 0) return text;
    text.append(chunk, static_cast<std::size_t>(got));
    if (text.size() > most) {
      throw Error(
          {.file = path.string(), .where = {}, .cause = "the file is too large", .remedy = {}});
    }
  }
}

void sync_folder(const std::filesystem::path& folder) {
  Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd.open()) throw failed(folder, "cannot open");
  // Some file systems cannot sync a folder and say so: nothing is lost by that.
  if (::fsync(fd.get()) != 0 && errno != EINVAL && errno != ENOTSUP) {
    throw failed(folder, "cannot sync");
  }
}

}  // namespace terrace::stream::store
