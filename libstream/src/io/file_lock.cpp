// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/file_lock.hpp"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

int flock_now(int descriptor) {
  while (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EINTR) return errno;
  }
  return 0;
}

}  // namespace

FileLock::FileLock(const std::filesystem::path& path) : path_(path) {
  for (;;) {
    constexpr int kFlags = O_RDWR | O_CLOEXEC | O_NOFOLLOW;
    descriptor_ = ::open(path.c_str(), kFlags | O_CREAT | O_EXCL, 0666);
    created_ = descriptor_ >= 0;
    if (!created_ && errno == EEXIST) {
      descriptor_ = ::open(path.c_str(), kFlags);
      if (descriptor_ < 0 && errno == ENOENT) continue;  // removed meanwhile
    }
    if (descriptor_ < 0) {
      throw system_error(path.string(), "cannot be created", errno, "choose a writable folder");
    }
    const int error = flock_now(descriptor_);
    exclusive_ = error == 0;
    if (error == EWOULDBLOCK) {
      ::close(std::exchange(descriptor_, -1));
      return;
    }
    // A holder may have removed the name between our open() and flock(). Our lock would then be on
    // a file that others do not find.
    if (has_name()) return;
    ::close(std::exchange(descriptor_, -1));
  }
}

FileLock::FileLock(FileLock&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      exclusive_(other.exclusive_),
      created_(other.created_) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  if (this != &other) {
    release();
    path_ = std::move(other.path_);
    descriptor_ = std::exchange(other.descriptor_, -1);
    exclusive_ = other.exclusive_;
    created_ = other.created_;
  }
  return *this;
}

bool FileLock::has_name() const {
  struct stat ours {
  }, named{};
  return ::fstat(descriptor_, &ours) == 0 && ::stat(path_.c_str(), &named) == 0 &&
         ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
}

void FileLock::release() noexcept {
  if (descriptor_ < 0) return;
  // The name is removed first, so that other processes that open it from now on create a new file.
  // Without working locks the file may belong to another process, so it is removed only if created
  // here.
  if (exclusive_ || created_) ::unlink(path_.c_str());
  ::close(std::exchange(descriptor_, -1));
}

}  // namespace terrace::stream
