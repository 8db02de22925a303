// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "serve/site.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/file_lock.hpp"

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kCopied = std::size_t{1} << 20;

stream::Error refused(const fs::path& path, const std::string& cause, const std::string& remedy) {
  return stream::Error({.file = path.string(), .where = {}, .cause = cause, .remedy = remedy});
}

void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = descriptor >= 0 && (::fsync(descriptor) == 0 || errno == EINVAL);
  const int number = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced) throw stream::system_error(folder.string(), "cannot sync", number);
}

void rename_folder(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) throw stream::system_error(to.string(), "cannot rename to", error.value());
}

/// By the format's own mark, in the file that is written last.
bool was_published(const fs::path& folder) {
  try {
    const auto file = stream::open_file(folder / "stores.json");
    if (file->size() > kCopied) return false;
    std::string text(file->size(), '\0');
    file->read(0, std::as_writable_bytes(std::span(text)));
    const auto json = nlohmann::json::parse(text, nullptr, false);
    return json.is_object() && json.value("format", "") == "terrace-stores";
  } catch (const std::exception&) {
    return false;
  }
}

/// Checks that nothing stands at `target` that may not be replaced.
bool check_target(const fs::path& target, bool replace) {
  std::error_code error;
  if (fs::symlink_status(target, error).type() == fs::file_type::not_found) return false;
  if (!replace) throw refused(target, "exists already", "name another folder, or give --force");
  if (!was_published(target)) {
    throw refused(target, "was not published by terrace, so --force does not replace it",
                  "remove it yourself or name another folder");
  }
  return true;
}

}  // namespace

Published publish(std::span<const stream::Store> stores, const fs::path& folder, bool replace,
                  unsigned repack_threads) {
  fs::path target = folder;
  if (!target.has_filename()) target = target.parent_path();
  if (!target.has_filename() || target.filename() == "." || target.filename() == "..") {
    throw refused(target, "this cannot be the name of a folder to publish in",
                  "give a folder that does not exist yet");
  }
  target = stream::follow_links(target);
  const fs::path parent = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const auto beside = [&](const char* ending) {
    return parent / ("." + target.filename().string() + ending);
  };
  if (std::error_code error; !fs::is_directory(parent, error)) {
    throw refused(target, "the folder " + parent.string() + " does not exist", "make it first");
  }
  const stream::FileLock lock(beside(".publish.lock"));
  if (!lock.held()) throw refused(target, "is being published by another process", "wait for it");
  // What a killed run has left.
  const fs::path staged = beside(".publish"), old = beside(".publish-old");
  std::error_code error;
  if (fs::exists(old, error) && !fs::exists(target, error)) rename_folder(old, target);
  fs::remove_all(staged, error);
  fs::remove_all(old, error);
  check_target(target, replace);

  Published published;
  try {
    std::vector<std::byte> piece(kCopied);
    const auto copy = [&](const std::string& name, const stream::ByteSource& source) {
      ++published.files;
      published.bytes += source.size();
      const fs::path path = staged / name;
      if (fs::exists(path)) return;
      fs::create_directories(path.parent_path());
      stream::AtomicFile file(path);
      for (std::uint64_t at = 0; at < source.size(); at += piece.size()) {
        for (const stream::Store& store : stores) store.check_stop();
        const auto part = std::span(piece).first(
            static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), source.size() - at)));
        source.read(at, part);
        file.write(part);
      }
      file.commit();
    };
    std::vector<stream::Store> shown(stores.begin(), stores.end());
    if (repack_threads > 0) {
      fs::create_directories(staged / "stores");
      const std::vector<std::string> names = site_names(stores);
      for (std::size_t i = 0; i < shown.size(); ++i) {
        const fs::path path = staged / "stores" / names[i];
        stream::repack(stores[i], path, /*replace=*/false, repack_threads);
        shown[i] = stream::Store::open(path);
      }
    }
    const Site site = make_site(shown);
    for (const auto& [name, resource] : site) {
      if (name != "stores.json") copy(name, *resource.bytes);
    }
    copy("stores.json", *site.at("stores.json").bytes);
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(staged)) {
      if (entry.is_directory()) sync_folder(entry.path());
    }
    sync_folder(staged);
    if (check_target(target, replace)) rename_folder(target, old);
    rename_folder(staged, target);
  } catch (...) {
    if (fs::exists(old, error) && !fs::exists(target, error)) fs::rename(old, target, error);
    fs::remove_all(staged, error);
    throw;
  }
  sync_folder(parent);
  fs::remove_all(old, error);
  return published;
}

}  // namespace terrace::tools
