// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "io/file_size_signal.hpp"
#include "io/output_placement.hpp"
#include "io/temporary.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kBufferBytes = 1u << 20;

constexpr const char* kNoteName = "user.terrace";

/// Returns the attribute's value, which is different after every change of a file.
std::string note_of(const struct stat& status) {
  return fmt::format("written, {} bytes, {}.{}", status.st_size, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec);
}

}  // namespace

struct AtomicFile::Impl {
  fs::path target;  ///< as given
  fs::path shown;   ///< its name in messages
  fs::path place;   ///< after following symbolic links
  fs::path temporary;
  Naming naming;
  OutputPlacement placement;  ///< set by complete()
  int descriptor = -1;
  std::uint64_t flushed = 0;  // bytes in the file; the buffer continues there
  std::vector<std::byte> buffer;

  ~Impl() {
    if (descriptor < 0) return;
    ::unlink(temporary.c_str());
    ::close(descriptor);
  }

  [[nodiscard]] Error failed(const std::string& action, int error_number) const {
    return system_error(shown.string(), action, error_number, remedy_for(error_number));
  }

  void check_target() const {
    std::error_code error;
    const fs::file_status status = fs::status(target, error);
    if (status.type() == fs::file_type::not_found) return;
    if (error) throw failed("cannot be inspected", error.value());
    if (status.type() != fs::file_type::regular) {
      throw Error(target.string(), "exists and is not a regular file")
          .remedy("choose another name");
    }
    if (naming.replace) return;
    throw already_exists(target.string());
  }

  /// Creates and locks the temporary file. Between the two steps another writer may take it for
  /// abandoned: it then holds the lock, or has already removed the file.
  void create() {
    sweep_temporaries(place);
    for (int attempt = 0;; ++attempt) {
      temporary = folder_of(place) / temporary_name(place, attempt);
      descriptor = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (descriptor < 0) {
        if (errno == EEXIST && attempt < 1000) continue;
        throw failed("cannot be created", errno);
      }
      // Work continues on file systems without locks (some network disks).
      const bool is_locked = ::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
      struct stat status {};
      if (!is_locked && ::fstat(descriptor, &status) == 0 && status.st_nlink > 0) return;
      ::close(std::exchange(descriptor, -1));
    }
  }

  void write_through(std::uint64_t offset, std::span<const std::byte> bytes) {
    const FileSizeSignalBlock block;
    while (!bytes.empty()) {
      const ssize_t n =
          ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (n < 0) {
        if (errno == EINTR) continue;
        throw failed("cannot be written", errno);
      }
      bytes = bytes.subspan(static_cast<std::size_t>(n));
      offset += static_cast<std::uint64_t>(n);
    }
  }

  void flush() {
    write_through(flushed, buffer);
    flushed += buffer.size();
    buffer.clear();
  }

  void complete() {
    flush();
    if (::fsync(descriptor) != 0) throw failed("cannot be synced", errno);
    // After the sync, the file's time is final. Without the attribute the file is still complete.
    struct stat status {};
    if (::fstat(descriptor, &status) == 0) {
      const std::string note = note_of(status);
      static_cast<void>(::fsetxattr(descriptor, kNoteName, note.data(), note.size(), 0));
    }
    placement = OutputPlacement(shown, place, temporary, naming);
  }

  /// Called after complete(), when the temporary name is gone or is that of the replaced file.
  /// The descriptor is closed last, so that the lock outlives the name.
  void finish() {
    const fs::path old = placement.replaced();
    if (!old.empty()) ::unlink(old.c_str());
    ::close(std::exchange(descriptor, -1));
  }
};

AtomicFile::AtomicFile(const fs::path& target, Naming naming) : impl_(std::make_shared<Impl>()) {
  impl_->target = target;
  impl_->shown = naming.shown.empty() ? target : naming.shown;
  impl_->naming = std::move(naming);
  if (!target.has_filename()) {
    throw Error(target.string(), "is not a file name").remedy("add a file name");
  }
  impl_->check_target();
  impl_->place = follow_links(target);
  impl_->create();
}

AtomicFile::~AtomicFile() = default;
AtomicFile::AtomicFile(AtomicFile&&) noexcept = default;
AtomicFile& AtomicFile::operator=(AtomicFile&&) noexcept = default;

void AtomicFile::write(std::span<const std::byte> bytes) {
  assert(impl_->descriptor >= 0);
  Impl& impl = *impl_;
  if (impl.buffer.size() + bytes.size() > kBufferBytes) impl.flush();
  if (bytes.size() >= kBufferBytes) {
    impl.write_through(impl.flushed, bytes);
    impl.flushed += bytes.size();
    return;
  }
  impl.buffer.insert(impl.buffer.end(), bytes.begin(), bytes.end());
}

void AtomicFile::write(std::string_view text) {
  write(std::as_bytes(std::span(text.data(), text.size())));
}

void AtomicFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  assert(impl_->descriptor >= 0);
  impl_->flush();
  impl_->write_through(offset, bytes);
  impl_->flushed = std::max(impl_->flushed, offset + bytes.size());
}

std::size_t AtomicFile::read_at(std::uint64_t offset, std::span<std::byte> bytes) {
  assert(impl_->descriptor >= 0);
  impl_->flush();
  std::size_t bytes_read = 0;
  while (bytes_read < bytes.size()) {
    const ssize_t n = ::pread(impl_->descriptor, bytes.data() + bytes_read,
                              bytes.size() - bytes_read, static_cast<off_t>(offset + bytes_read));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw impl_->failed("cannot be read back", errno);
    if (n == 0) break;
    bytes_read += static_cast<std::size_t>(n);
  }
  return bytes_read;
}

std::uint64_t AtomicFile::size() const { return impl_->flushed + impl_->buffer.size(); }

void AtomicFile::commit() {
  assert(impl_->descriptor >= 0);
  impl_->complete();
  if (impl_->naming.group != nullptr) {
    impl_->naming.group->files_.push_back(impl_);
    return;
  }
  const std::array<OutputPlacement*, 1> outputs{&impl_->placement};
  publish_all(outputs);
  impl_->finish();
}

const fs::path& AtomicFile::target() const { return impl_->target; }

OutputGroup::OutputGroup() = default;
OutputGroup::~OutputGroup() = default;

void OutputGroup::commit() {
  std::vector<OutputPlacement*> outputs;
  for (const auto& file : files_) outputs.push_back(&file->placement);
  publish_all(outputs);
  for (const auto& file : files_) file->finish();
  files_.clear();
}

bool is_unchanged_output(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  std::array<char, 100> note{};
  const ssize_t size = ::getxattr(path.c_str(), kNoteName, note.data(), note.size());
  return size > 0 &&
         std::string_view(note.data(), static_cast<std::size_t>(size)) == note_of(status);
}

void remove_abandoned(const fs::path& target) { sweep_temporaries(follow_links(target)); }

}  // namespace terrace::stream
