// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded into the command by LD_PRELOAD: stops it at a chosen step of its disk operations.
//
// A step is a call that changes files or folders. Environment:
//   FAULT_STEP     the number, from 1, of the step at which to stop
//   FAULT_KIND     kill: dies by SIGKILL with a write half done, or before any other step
//                  power: the same, and bytes that were not synced are lost
//                  pause: sends itself SIGSTOP before the step, and continues on SIGCONT
//                  fail: a sync, rename or link reports EIO and does nothing; other steps succeed
//   FAULT_LOG      a file to which the name of each step is appended, one per line
//   FAULT_NO_EXCHANGE  renameat2() fails with EINVAL, as on some network disks
// Defines both variants of each function name instead of mapping one to the other.
#undef _FILE_OFFSET_BITS
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <vector>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

namespace {

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int real_open(const char* path, int flags, mode_t mode = 0) {
  return next<int(const char*, int, ...)>("open")(path, flags, mode);
}

/// A file with bytes that are not yet synced.
struct Unsynced {
  dev_t device;
  ino_t inode;
  off_t safe;      // synced bytes
  int descriptor;  // opened by this library
};

std::recursive_mutex mutex;
std::vector<Unsynced>& unsynced() {
  static auto* files = new std::vector<Unsynced>;  // never destroyed: others may still write
  return *files;
}
long steps = 0;

const char* kind() {
  const char* text = getenv("FAULT_KIND");
  return text == nullptr ? "" : text;
}

bool is_file(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

void log_step(const char* name) {
  const char* path = getenv("FAULT_LOG");
  if (path == nullptr) return;
  static const int log = real_open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  char line[64];
  const int length = snprintf(line, sizeof line, "%s\n", name);
  next<ssize_t(int, const void*, size_t)>("write")(log, line, static_cast<size_t>(length));
}

[[noreturn]] void die() {
  if (strcmp(kind(), "power") == 0) {
    for (const Unsynced& file : unsynced()) {
      if (ftruncate(file.descriptor, file.safe) != 0) abort();
    }
  }
  raise(SIGKILL);
  abort();
}

/// Counts a step. Returns true if the command must die at it; the caller then calls die().
bool last_step(const char* name) {
  log_step(name);
  const char* wanted = getenv("FAULT_STEP");
  if (++steps != (wanted == nullptr ? 0 : atol(wanted))) return false;
  if (strcmp(kind(), "fail") == 0) return false;
  if (strcmp(kind(), "pause") != 0) return true;
  raise(SIGSTOP);
  return false;
}

void step(const char* name) {
  const std::lock_guard lock(mutex);
  if (last_step(name)) die();
}

/// The same for a call that can be made to fail. Returns true, with errno set, if it must fail.
bool step_fails(const char* name) {
  step(name);
  const char* wanted = getenv("FAULT_STEP");
  if (strcmp(kind(), "fail") != 0 || wanted == nullptr || steps != atol(wanted)) return false;
  errno = EIO;
  return true;
}

void remember(int descriptor) {
  struct stat status {};
  if (strcmp(kind(), "power") != 0 || fstat(descriptor, &status) != 0) return;
  for (const Unsynced& file : unsynced()) {
    if (file.device == status.st_dev && file.inode == status.st_ino) return;
  }
  char path[64];
  snprintf(path, sizeof path, "/proc/self/fd/%d", descriptor);
  const int own = real_open(path, O_WRONLY | O_CLOEXEC);
  if (own < 0) abort();
  unsynced().push_back({status.st_dev, status.st_ino, status.st_size, own});
}

void forget(const Unsynced& file) { close(file.descriptor); }

void synced(int descriptor) {
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return;
  std::erase_if(unsynced(), [&](const Unsynced& file) {
    const bool this_one = file.device == status.st_dev && file.inode == status.st_ino;
    if (this_one) forget(file);
    return this_one;
  });
}

/// Performs half of a write if the command must die at it.
template <class Whole, class Half>
ssize_t do_write(const char* name, int descriptor, const Whole& whole, const Half& half) {
  if (!is_file(descriptor)) return whole();
  const std::lock_guard lock(mutex);
  const bool last = last_step(name);
  remember(descriptor);
  if (!last) return whole();
  half();
  die();
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* data, size_t size) {
  const auto real = next<ssize_t(int, const void*, size_t)>("write");
  return do_write(
      "write", fd, [&] { return real(fd, data, size); }, [&] { return real(fd, data, size / 2); });
}

ssize_t writev(int fd, const iovec* parts, int count) {
  const auto real = next<ssize_t(int, const iovec*, int)>("writev");
  return do_write(
      "write", fd, [&] { return real(fd, parts, count); },
      [&] { return real(fd, parts, count / 2); });
}

ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  const auto real = next<ssize_t(int, const void*, size_t, off_t)>("pwrite");
  return do_write(
      "write", fd, [&] { return real(fd, data, size, at); },
      [&] { return real(fd, data, size / 2, at); });
}

ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  return pwrite(fd, data, size, at);
}

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if ((flags & (O_CREAT | O_TRUNC)) != 0) step("create");
  return real_open(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return open(path, flags, mode);
}

int fsync(int fd) {
  if (step_fails("sync")) return -1;
  const int result = next<int(int)>("fsync")(fd);
  const std::lock_guard lock(mutex);
  if (result == 0) synced(fd);
  return result;
}

/// Treated as a sync of all files, because the test's folder is on one of the file systems.
int syncfs(int fd) {
  if (step_fails("sync")) return -1;
  const std::lock_guard lock(mutex);
  // The real sync would wait for the writes of other programs.
  static_cast<void>(fd);
  for (const Unsynced& file : unsynced()) forget(file);
  unsynced().clear();
  return 0;
}

int rename(const char* from, const char* to) {
  if (step_fails("rename")) return -1;
  return next<int(const char*, const char*)>("rename")(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned int flags) {
  if (getenv("FAULT_NO_EXCHANGE") != nullptr) {
    errno = EINVAL;
    return -1;
  }
  if (step_fails("rename")) return -1;
  return next<int(int, const char*, int, const char*, unsigned int)>("renameat2")(
      from_folder, from, to_folder, to, flags);
}

int link(const char* from, const char* to) {
  if (step_fails("link")) return -1;
  return next<int(const char*, const char*)>("link")(from, to);
}

int unlink(const char* path) {
  step("remove");
  return next<int(const char*)>("unlink")(path);
}

int unlinkat(int folder, const char* path, int flags) {
  step("remove");
  return next<int(int, const char*, int)>("unlinkat")(folder, path, flags);
}

int remove(const char* path) {
  step("remove");
  return next<int(const char*)>("remove")(path);
}

int rmdir(const char* path) {
  step("remove");
  return next<int(const char*)>("rmdir")(path);
}

int mkdir(const char* path, mode_t mode) {
  step("mkdir");
  return next<int(const char*, mode_t)>("mkdir")(path, mode);
}

int truncate(const char* path, off_t size) {
  step("truncate");
  return next<int(const char*, off_t)>("truncate")(path, size);
}

}  // extern "C"
