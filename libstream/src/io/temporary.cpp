// SPDX-License-Identifier: Apache-2.0
#include "io/temporary.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/file_lock.hpp"
#include "terrace/stream/network.hpp"

namespace terrace::stream {
namespace fs = std::filesystem;
namespace {

/// File systems limit names to 255 bytes: a hash (64-bit FNV-1a) replaces a long name.
std::string prefix_of(const fs::path& target) {
  constexpr std::size_t kMaxName = 200;
  std::string name = target.filename().string();
  if (name.size() > kMaxName) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    name = fmt::format("terrace-{}", hash);
  }
  return std::string(".").append(name).append(".tmp-");
}

bool drop_ending(std::string& name, std::string_view ending) {
  if (!name.ends_with(ending)) return false;
  name.resize(name.size() - ending.size());
  return true;
}

bool nothing_at(const fs::path& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) != 0 && errno == ENOENT;
}

/// PID or PID-ATTEMPT. Distinguishes `a` from `a.tmp-b`, whose prefixes begin alike.
bool is_number_of_writer(std::string_view text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const std::size_t dash = std::min(text.find('-'), text.size());
  const std::string_view pid = text.substr(0, dash), attempt = text.substr(dash);
  return !pid.empty() && std::all_of(pid.begin(), pid.end(), is_digit) && attempt.size() != 1 &&
         (attempt.empty() || std::all_of(attempt.begin() + 1, attempt.end(), is_digit));
}

/// Returns the temporary files of `target`, complete or partial, without their endings.
std::set<std::string> temporaries_of(const fs::path& target) {
  const std::string prefix = prefix_of(target);
  std::set<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(folder_of(target), error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::string name = entry->path().filename().string();
    if (!name.starts_with(prefix)) continue;
    if (!drop_ending(name, kLockEnding)) drop_ending(name, kReplacedEnding);
    if (!is_number_of_writer(std::string_view(name).substr(prefix.size()))) continue;
    names.insert(std::move(name));
  }
  return names;
}

fs::path with_ending(const fs::path& path, const char* ending) {
  return fs::path(path).concat(ending);
}

/// Returns the lock of a temporary file; not exclusive if its writer is or may be alive.
FileLock lock_of_dead(const fs::path& temporary) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(temporary, error);
  try {
    return FileLock(fs::is_regular_file(status) ? temporary : with_ending(temporary, kLockEnding));
  } catch (const Error&) {
    return {};  // it belongs to another process, or is not writable
  }
}

/// Whether a folder is still complete: its mark is removed first.
bool has_mark(const fs::path& folder, const std::string& mark) {
  std::error_code ignored;
  return fs::is_regular_file(folder / mark, ignored);
}

bool restore(const fs::path& replaced, const fs::path& target, const std::string& mark) {
  if (!nothing_at(target) || !has_mark(replaced, mark)) return false;
  return rename_exclusively(replaced, target) == 0;
}

/// As fs::remove_all(), which keeps a descriptor open for each folder on the way.
void remove_tree(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(fs::symlink_status(path, error))) {
    std::vector<fs::path> entries;
    for (fs::directory_iterator entry(path, error); !error && entry != fs::directory_iterator();
         entry.increment(error)) {
      entries.push_back(entry->path());
    }
    for (const fs::path& entry : entries) remove_tree(entry);
  }
  fs::remove(path, error);
}

}  // namespace

fs::path follow_links(fs::path path) {
  if (is_url(path.string())) {
    throw Error(shown_url(path.string()), "files are not written over the network")
        .remedy("write to this machine and copy the result");
  }
  constexpr int kMaxLinks = 40;  // the same as Linux
  for (int links = 0; links <= kMaxLinks; ++links) {
    std::error_code error;
    const fs::path next = fs::read_symlink(path, error);
    if (error) return path;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  throw system_error(path.string(), "the symbolic links cannot be followed", ELOOP);
}

fs::path folder_of(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

std::string temporary_name(const fs::path& target, int attempt) {
  std::string name = fmt::format("{}{}", prefix_of(target), ::getpid());
  return attempt == 0 ? name : fmt::format("{}-{}", name, attempt);
}

void sweep_temporaries(const fs::path& target, const std::string& mark) {
  for (const std::string& name : temporaries_of(target)) {
    const fs::path temporary = folder_of(target) / name;
    const FileLock lock = lock_of_dead(temporary);
    if (!lock.exclusive()) continue;
    const fs::path replaced = with_ending(temporary, kReplacedEnding);
    restore(replaced, target, mark);
    // Keeps the old output if restoring it failed and the name is still free.
    if (!nothing_at(target) || !has_mark(replaced, mark)) remove_marked_folder(replaced, mark);
    // A file is removed with its lock.
    std::error_code ignored;
    if (fs::is_directory(fs::symlink_status(temporary, ignored))) {
      remove_marked_folder(temporary, mark);
    }
  }
}

bool restore_replaced(fs::path target) {
  if (!target.has_filename()) target = target.parent_path();
  if (!nothing_at(target)) return false;
  for (const std::string& name : temporaries_of(target)) {
    const fs::path temporary = folder_of(target) / name;
    const fs::path replaced = with_ending(temporary, kReplacedEnding);
    if (nothing_at(replaced)) continue;
    const FileLock lock = lock_of_dead(temporary);
    if (lock.exclusive() && restore(replaced, target, kManifestName)) return true;
  }
  return false;
}

int rename_exclusively(const fs::path& from, const fs::path& to) {
#ifdef RENAME_NOREPLACE
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
#endif
  // Linking, unlike renaming, fails if the name is taken. Folders have one name only.
  std::error_code ignored;
  if (!fs::is_directory(fs::symlink_status(from, ignored))) {
    if (::link(from.c_str(), to.c_str()) == 0) {
      ::unlink(from.c_str());
      return 0;
    }
    if (errno == EEXIST) return EEXIST;
  }
  if (!nothing_at(to)) return EEXIST;
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

void remove_marked_folder(const fs::path& folder, const std::string& mark) noexcept {
  try {
    std::error_code ignored;
    fs::remove(folder / mark, ignored);
    remove_tree(folder);
  } catch (...) {  // no memory for the names
  }
}

}  // namespace terrace::stream
