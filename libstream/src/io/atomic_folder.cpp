// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/output_placement.hpp"
#include "io/temporary.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/file_lock.hpp"

namespace terrace::stream {
namespace fs = std::filesystem;

struct AtomicFolder::Impl {
  fs::path target, folder;  ///< `folder` is empty once published and the old one is removed
  std::string mark;
  Naming naming;
  FileLock lock;
  int spare = -1;  ///< keeps a descriptor for listing and removing the folder if none are left

  void remove(const fs::path& path) {
    if (spare >= 0) ::close(std::exchange(spare, -1));
    remove_marked_folder(path, mark);
  }
  ~Impl() {
    if (!folder.empty()) remove(folder);  // before the lock is released
    if (spare >= 0) ::close(spare);
  }

  void create() {
    const fs::path parent = folder_of(target);
    // One process may have two writers of the same folder; the first to finish wins.
    for (int attempt = 0;; ++attempt) {
      const fs::path path = parent / temporary_name(target, attempt);
      lock = FileLock(fs::path(path).concat(kLockEnding));
      if (!lock.held()) continue;
      if (lock.exclusive()) remove_marked_folder(path, mark);
      if (::mkdir(path.c_str(), 0777) == 0) {
        folder = path;
        break;
      }
      if (errno != EEXIST || attempt >= 1000) {
        throw system_error(target.string(), "cannot be created", errno, "choose a writable folder");
      }
    }
    spare = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (spare < 0 && errno != EACCES)
      throw system_error(target.string(), "cannot be opened", errno);
  }
};

AtomicFolder::AtomicFolder(fs::path target, std::string mark, Naming naming)
    : impl_(std::make_unique<Impl>()) {
  // "store/" names the same folder as "store".
  if (!target.has_filename()) target = target.parent_path();
  if (!target.has_filename() || target.filename() == "." || target.filename() == "..") {
    throw Error(target.string(), "this cannot be the name of a new folder")
        .remedy("give a name that does not exist yet");
  }
  Impl& impl = *impl_;
  impl.target = follow_links(std::move(target));
  impl.mark = std::move(mark);
  impl.naming = std::move(naming);
  const fs::path parent = folder_of(impl.target);
  std::error_code error;
  if (!fs::is_directory(parent, error)) {
    throw Error(impl.target.string(), "the folder " + parent.string() + " does not exist")
        .remedy("create it first");
  }
  sweep_temporaries(impl.target, impl.mark);
  impl.create();
}

AtomicFolder::~AtomicFolder() = default;

const fs::path& AtomicFolder::folder() const { return impl_->folder; }
const fs::path& AtomicFolder::target() const { return impl_->target; }

void AtomicFolder::commit() {
  Impl& impl = *impl_;
  std::error_code error;
  fs::recursive_directory_iterator at(impl.folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    if (fs::is_directory(at->symlink_status())) sync_folder(at->path());
  }
  if (error) throw system_error(impl.target.string(), "cannot be listed", error.value());
  sync_folder(impl.folder);
  OutputPlacement placement(impl.target, impl.target, impl.folder, impl.naming);
  const std::array<OutputPlacement*, 1> outputs{&placement};
  publish_all(outputs);
  impl.folder.clear();
  if (const fs::path old = placement.replaced(); !old.empty()) impl.remove(old);
  impl.lock.release();
}

}  // namespace terrace::stream
