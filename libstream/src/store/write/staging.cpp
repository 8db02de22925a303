// SPDX-License-Identifier: Apache-2.0
#include "store/write/staging.hpp"

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/temporary.hpp"
#include "store/write/output_file.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

namespace fs = std::filesystem;

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
  target_ = follow_links(target_);
  const fs::path parent = folder_of(target_);
  std::error_code error;
  if (!fs::is_directory(parent, error)) {
    throw Error({.file = target_.string(),
                 .where = {},
                 .cause = "the folder " + parent.string() + " does not exist",
                 .remedy = "make it first"});
  }
  sweep_temporaries(target_);
  // One process may write the same store twice at a time; the first to finish wins.
  for (int attempt = 0;; ++attempt) {
    folder_ = parent / temporary_name(target_, attempt);
    lock_ = FileLock(fs::path(folder_).concat(kLockEnding));
    if (!lock_.held()) continue;
    if (lock_.exclusive()) fs::remove_all(folder_, error);
    if (::mkdir(folder_.c_str(), 0777) == 0) return;
    if (errno != EEXIST || attempt >= 1000) {
      throw system_error(folder_.string(), "cannot create", errno);
    }
  }
}

Staging::~Staging() {
  if (!folder_.empty()) remove_store_folder(folder_);  // before the lock goes
}

void Staging::publish(bool replace) {
  sync_folder(folder_);
  const int number = rename_exclusively(folder_, target_);
  if (replace && (number == EEXIST || number == ENOTEMPTY)) {
    if (!exchange(folder_, target_)) {
      const fs::path old = fs::path(folder_).concat(kReplacedEnding);
      if (::rename(target_.c_str(), old.c_str()) != 0) {
        throw system_error(target_.string(), "cannot replace", errno);
      }
      if (::rename(folder_.c_str(), target_.c_str()) != 0) {
        const int why = errno;
        ::rename(old.c_str(), target_.c_str());
        throw system_error(target_.string(), "cannot replace", why);
      }
      folder_ = old;
    }
  } else if (number == EEXIST || number == ENOTEMPTY || number == ENOTDIR) {
    throw Error({.file = target_.string(),
                 .where = {},
                 .cause = "exists already",
                 .remedy = "choose another name or remove it"});
  } else if (number != 0) {
    throw system_error(target_.string(), "cannot rename to", number);
  }
  sync_folder(folder_of(target_));
  remove_store_folder(folder_);
  folder_.clear();
  lock_.release();
}

}  // namespace terrace::stream::store
