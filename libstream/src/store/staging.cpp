// SPDX-License-Identifier: Apache-2.0
#include "staging.hpp"

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../temporary_name.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

namespace fs = std::filesystem;

/// The lock file, made if need be, locked. Not open: somebody holds it.
Descriptor try_lock(const fs::path& path) {
  for (;;) {
    Descriptor fd(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
    if (!fd.open()) throw system_error(path.string(), "cannot create", errno);
    if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
      if (errno == EINTR) continue;
      if (errno == EWOULDBLOCK) return {};
      throw system_error(path.string(), "cannot lock", errno);
    }
    // A dying writer may have removed the name between our open and our lock: then what we hold is
    // no longer what others will find.
    struct stat ours {
    }, named{};
    if (::fstat(fd.get(), &ours) == 0 && ::stat(path.c_str(), &named) == 0 &&
        ours.st_ino == named.st_ino && ours.st_dev == named.st_dev) {
      return fd;
    }
  }
}

/// Removes the folders of writers that died, told by a lock that can be taken.
void remove_leftovers(const fs::path& parent, const std::string& prefix) {
  std::error_code ignored;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(parent, ignored)) {
    std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix)) continue;
    if (name.ends_with(".lock")) name.resize(name.size() - 5);
    names.push_back(std::move(name));
  }
  for (const std::string& name : names) {
    const fs::path lock_path = parent / (name + ".lock");
    const Descriptor lock = try_lock(lock_path);
    if (!lock.open()) continue;
    fs::remove_all(parent / name, ignored);
    fs::remove(lock_path, ignored);
  }
}

int rename_exclusively(const fs::path& from, const fs::path& to) {
#ifdef RENAME_NOREPLACE
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
#endif
  // Without it an empty folder that appears just now would be replaced; anything else would not.
  struct stat status {};
  if (::lstat(to.c_str(), &status) == 0) return EEXIST;
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

bool exchange(const fs::path& a, const fs::path& b) {
#ifdef RENAME_EXCHANGE
  return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0;
#else
  return false;
#endif
}

}  // namespace

Staging::Staging(fs::path target) : target_(std::move(target)) {
  // "store/" names the same folder as "store".
  if (!target_.has_filename()) target_ = target_.parent_path();
  if (!target_.has_filename() || target_.filename() == "." || target_.filename() == "..") {
    throw Error({.file = target_.string(),
                 .where = {},
                 .cause = "this cannot be the name of a store",
                 .remedy = "give a folder that does not exist yet"});
  }
  parent_ = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  const std::string prefix = temporary_prefix(target_.filename().string());
  std::error_code error;
  if (!fs::is_directory(parent_, error)) {
    throw Error({.file = target_.string(),
                 .where = {},
                 .cause = "the folder " + parent_.string() + " does not exist",
                 .remedy = "make it first"});
  }
  remove_leftovers(parent_, prefix);
  // One process may write the same store twice at a time; the first to finish wins.
  for (int attempt = 0;; ++attempt) {
    std::string name = prefix + std::to_string(::getpid());
    if (attempt > 0) name.append("-").append(std::to_string(attempt));
    lock_path_ = parent_ / (name + ".lock");
    lock_ = try_lock(lock_path_);
    if (!lock_.open()) continue;
    folder_ = parent_ / name;
    fs::remove_all(folder_, error);
    if (::mkdir(folder_.c_str(), 0777) == 0) return;
    const int number = errno;
    remove();
    throw system_error(folder_.string(), "cannot create", number);
  }
}

Staging::~Staging() {
  if (!published_) remove();
}

void Staging::remove() noexcept {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  fs::remove(lock_path_, ignored);
  lock_ = Descriptor();
}

void Staging::publish(bool replace) {
  sync_folder(folder_);
  const int number = rename_exclusively(folder_, target_);
  if (number == 0) {
    published_ = true;
  } else if (replace && (number == EEXIST || number == ENOTEMPTY)) {
    if (exchange(folder_, target_)) {
      published_ = true;  // the folder now holds the old store
    } else {
      const fs::path old = folder_.string() + "-old";
      if (::rename(target_.c_str(), old.c_str()) != 0) {
        throw system_error(target_.string(), "cannot replace", errno);
      }
      if (::rename(folder_.c_str(), target_.c_str()) != 0) {
        const int why = errno;
        ::rename(old.c_str(), target_.c_str());
        throw system_error(target_.string(), "cannot replace", why);
      }
      published_ = true;
      folder_ = old;
    }
  } else if (number == EEXIST || number == ENOTEMPTY || number == ENOTDIR) {
    throw Error({.file = target_.string(),
                 .where = {},
                 .cause = "exists already",
                 .remedy = "choose another name or remove it"});
  } else {
    throw system_error(target_.string(), "cannot rename to", number);
  }
  sync_folder(parent_);
  remove();
}

}  // namespace terrace::stream::store
