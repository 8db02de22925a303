// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <string>
#include <system_error>

#include <nlohmann/json.hpp>

#include "serve/site.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;

/// It is written last.
constexpr const char* kMark = "stores.json";
constexpr std::size_t kCopied = std::size_t{1} << 20;

stream::Error refused(const fs::path& path, const std::string& cause, const std::string& remedy) {
  return stream::Error({.file = path.string(), .where = {}, .cause = cause, .remedy = remedy});
}

/// By the format's own mark.
bool was_published(const fs::path& folder) {
  try {
    const auto file = stream::open_file(folder / kMark);
    if (file->size() > kCopied) return false;
    std::string text(file->size(), '\0');
    file->read(0, std::as_writable_bytes(std::span(text)));
    const auto json = nlohmann::json::parse(text, nullptr, false);
    return json.is_object() && json.value("format", "") == "terrace-stores";
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace

Published publish(std::span<const stream::Store> stores, const fs::path& folder, bool replace,
                  unsigned repack_threads) {
  stream::AtomicFolder site_folder(folder, kMark,
                                   replace ? stream::Naming(was_published) : stream::Naming());
  const fs::path &staged = site_folder.folder(), &target = site_folder.target();
  // Before the work; commit() looks again.
  if (std::error_code error; fs::symlink_status(target, error).type() != fs::file_type::not_found) {
    if (!replace) throw refused(target, "exists already", "name another folder, or give --force");
    if (!was_published(target)) {
      throw refused(target, "was not published by terrace, so --force does not replace it",
                    "remove it yourself or name another folder");
    }
  }
  Published published;
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
    if (name != kMark) copy(name, *resource.bytes);
  }
  copy(kMark, *site.at(kMark).bytes);
  site_folder.commit();
  return published;
}

}  // namespace terrace::tools
