// SPDX-License-Identifier: Apache-2.0
#include "tile/set/file.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <terrace/stream/error.hpp>
#include <unistd.h>

#include "tile/format/address.hpp"

namespace terrace::terrain {
namespace {

constexpr const char* kTemporaryEnding = ".tmp";

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool close() { return ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

bool write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

std::vector<std::byte> read_tile_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return {};
    throw stream::system_error(path, "cannot be opened", errno);
  }
  struct stat status {};
  if (::fstat(file.number(), &status) != 0 || !S_ISREG(status.st_mode)) {
    throw stream::system_error(path, "is not a file that can be read", errno);
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
  std::size_t at = 0;
  while (at < bytes.size()) {
    const ssize_t got = ::read(file.number(), bytes.data() + at, bytes.size() - at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw stream::system_error(path, "cannot be read", errno);
    if (got == 0) break;
    at += static_cast<std::size_t>(got);
  }
  bytes.resize(at);
  return bytes;
}

void write_tile_file(const std::string& path, std::span<const std::byte> bytes) {
  const std::filesystem::path target(path);
  std::error_code error;
  std::filesystem::create_directories(target.parent_path(), error);
  if (error) {
    throw stream::system_error(target.parent_path().string(), "cannot be created", error.value());
  }
  std::string temporary = target.parent_path().string();
  temporary.append("/.").append(target.filename().string()).append(kTemporaryEnding);
  temporary += fmt::format("-{}", ::getpid());
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC,
                         S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH));
  if (file.number() < 0) throw stream::system_error(path, "cannot be created", errno);
  if (!write_all(file.number(), bytes) || !file.close() ||
      ::rename(temporary.c_str(), path.c_str()) != 0) {
    const int cause = errno;
    ::unlink(temporary.c_str());
    throw stream::system_error(path, "cannot be written", cause,
                               stream::message("make room and run again with {resume}"));
  }
}

bool is_torn_tile(std::string_view path) {
  const std::string_view name = path.substr(path.rfind('/') + 1);
  const std::size_t end = name.rfind(kTemporaryEnding);
  if (!name.starts_with('.') || end == std::string_view::npos || end == 0) return false;
  std::string_view pid = name.substr(end + std::string_view(kTemporaryEnding).size());
  if (pid.starts_with('-')) pid.remove_prefix(1);  // versions before locks wrote no number
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (!std::all_of(pid.begin(), pid.end(), is_digit)) return false;
  std::string tile(path.substr(0, path.size() - name.size()));
  tile += name.substr(1, end - 1);
  return parse_tile_path(tile).has_value();
}

void sync_files(const std::string& folder) {
  const Descriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file.number() < 0 || ::syncfs(file.number()) != 0) {
    throw stream::system_error(folder, "cannot be synced", errno);
  }
}

void sync_names(const std::string& folder) {
  const Descriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Some file systems report that they cannot sync a folder, which does no harm.
  if (file.number() < 0 || (::fsync(file.number()) != 0 && errno != EINVAL && errno != ENOTSUP)) {
    throw stream::system_error(folder, "cannot be synced", errno);
  }
}

}  // namespace terrace::terrain
