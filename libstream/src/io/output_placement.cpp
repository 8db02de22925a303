// SPDX-License-Identifier: Apache-2.0
#include "io/output_placement.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/temporary.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace fs = std::filesystem;
namespace {

/// rename() in one step of two existing names; returns errno.
int exchange([[maybe_unused]] const fs::path& a, [[maybe_unused]] const fs::path& b) {
#ifdef RENAME_EXCHANGE
  return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0 ? 0 : errno;
#else
  return ENOSYS;
#endif
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(fs::symlink_status(path, ignored));
}

}  // namespace

Ownership ownership_of_entries(
    const fs::path& folder, const std::function<Ownership(const fs::directory_entry&)>& of_entry) {
  std::string first;
  Ownership result(true);
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!result.ours && first < name) continue;
    const Ownership ownership = of_entry(*entry);
    if (ownership.ours) continue;
    first = name;
    result = Ownership::except(ownership.stranger.empty() ? name : name + "/" + ownership.stranger);
  }
  return error ? Ownership(false) : result;
}

Error already_exists(std::string file) {
  return Error(std::move(file), "exists already")
      .remedy("remove it, choose another name, or ask to replace it")
      .error_number(EEXIST);
}

Error not_replaced(std::string file, const Ownership& found) {
  if (found.stranger.empty()) {
    return Error(std::move(file), "exists and was not written by terrace, so it is not replaced")
        .remedy("move it away or choose another name")
        .error_number(EEXIST);
  }
  return Error(std::move(file), "contains " + found.stranger +
                                    ", which terrace did not write, so it is not replaced")
      .remedy("move it away or choose another name")
      .error_number(EEXIST);
}

OutputPlacement::OutputPlacement(fs::path shown, fs::path place, fs::path temporary, Naming naming)
    : shown_(std::move(shown)),
      place_(std::move(place)),
      temporary_(std::move(temporary)),
      naming_(std::move(naming)) {}

fs::path OutputPlacement::backup_path() const {
  return fs::path(temporary_).concat(kReplacedEnding);
}

fs::path OutputPlacement::replaced() const {
  if (state_ == State::exchanged) return temporary_;
  return state_ == State::backed_up ? backup_path() : fs::path();
}

Ownership OutputPlacement::ownership_of(const fs::path& old) const noexcept {
  try {
    // A file replaces files, a folder replaces folders: after an exchange `temporary_` is the old
    // output, and the new one has the place.
    const fs::path& ours = old == temporary_ ? place_ : temporary_;
    const bool same_kind =
        is_folder(ours) ? is_folder(old) : fs::is_regular_file(fs::symlink_status(old));
    if (!same_kind || !naming_.is_ours) return same_kind;
    return naming_.is_ours(old);
  } catch (...) {
    return false;  // a file that cannot be examined is not ours
  }
}

Error OutputPlacement::failed(int error_number) const {
  return system_error(shown_.string(), "cannot be renamed into place", error_number);
}

/// False if the name is free by now. Throws: Error.
bool OutputPlacement::publish_by_exchange() {
  const int number = exchange(temporary_, place_);
  if (number == ENOENT) return false;
  if (number == EINVAL || number == ENOSYS) return publish_by_renames();
  if (number != 0) throw failed(number);
  state_ = State::exchanged;
  // Another process may have taken the name since it was checked.
  const Ownership ownership = ownership_of(temporary_);
  if (ownership.ours) return true;
  undo();
  throw not_replaced(shown_.string(), ownership);
}

/// For file systems that cannot exchange names.
bool OutputPlacement::publish_by_renames() {
  const fs::path old = backup_path();
  if (!is_folder(temporary_)) {
    // A file is replaced by one rename. A second name keeps the old one until all has gone well.
    const bool has_backup = ::link(place_.c_str(), old.c_str()) == 0;
    const Ownership ownership = ownership_of(has_backup ? old : place_);
    if (!ownership.ours || ::rename(temporary_.c_str(), place_.c_str()) != 0) {
      const int error = errno;
      if (has_backup) ::unlink(old.c_str());
      if (!ownership.ours) throw not_replaced(shown_.string(), ownership);
      throw failed(error);
    }
    state_ = has_backup ? State::backed_up : State::lost;
    return true;
  }
  if (::rename(place_.c_str(), old.c_str()) != 0) {
    if (errno == ENOENT) return false;
    throw failed(errno);
  }
  const Ownership ownership = ownership_of(old);
  const int number = ownership.ours ? rename_exclusively(temporary_, place_) : 0;
  if (!ownership.ours || number != 0) {
    rename_exclusively(old, place_);
    if (!ownership.ours) throw not_replaced(shown_.string(), ownership);
    throw failed(number);
  }
  state_ = State::backed_up;
  return true;
}

void OutputPlacement::publish() {
  // The name may be taken or become free between two steps.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const int number = rename_exclusively(temporary_, place_);
    if (number == 0) {
      state_ = State::created;
      return;
    }
    if (number != EEXIST && number != ENOTEMPTY && number != ENOTDIR && number != EISDIR) {
      throw failed(number);
    }
    if (!naming_.replace) throw already_exists(shown_.string());
    const Ownership ownership = ownership_of(place_);
    if (!ownership.ours) {
      std::error_code ignored;
      if (!fs::exists(fs::symlink_status(place_, ignored))) continue;
      throw not_replaced(shown_.string(), ownership);
    }
    if (publish_by_exchange()) return;
  }
  throw failed(EBUSY);
}

void OutputPlacement::undo() noexcept {
  switch (state_) {
    case State::created:
      rename_exclusively(place_, temporary_);
      break;
    case State::exchanged:
      exchange(temporary_, place_);
      break;
    case State::backed_up:
      if (is_folder(place_)) ::rename(place_.c_str(), temporary_.c_str());
      ::rename(backup_path().c_str(), place_.c_str());
      break;
    case State::pending:
    case State::lost:
      break;
  }
  state_ = State::pending;
}

std::string remedy_for(int error_number) {
  switch (error_number) {
    case ENOSPC:
    case EDQUOT:
      return "free space or choose another disk";
    case EFBIG:
      return "raise the file size limit (ulimit -f) or choose another file system";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a writable folder";
    case ENOENT:
      return "create the folder first";
    default:
      return {};
  }
}

void publish_all(std::span<OutputPlacement* const> outputs) {
  std::size_t count = 0;
  try {
    std::set<fs::path> folders;
    for (; count < outputs.size(); ++count) {
      outputs[count]->publish();
      folders.insert(folder_of(outputs[count]->place()));
    }
    for (const fs::path& folder : folders) sync_folder(folder);
  } catch (...) {
    while (count > 0) outputs[--count]->undo();
    throw;
  }
}

void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  int number = descriptor < 0 ? errno : 0;
  if (descriptor >= 0) {
    if (::fsync(descriptor) != 0) number = errno;
    ::close(descriptor);
  }
  // A folder that may be written but not read cannot be opened.
  if (number == 0 || (descriptor < 0 ? number == EACCES : number == EINVAL || number == ENOTSUP)) {
    return;
  }
  throw system_error(folder.string(), "this folder cannot be synced", number,
                     "check the disk; the previous output is kept");
}

}  // namespace terrace::stream
