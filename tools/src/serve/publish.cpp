// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "serve/site.hpp"
#include "serve/viewer_files.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;

/// The file that marks a published folder; it is written last.
constexpr const char* kMark = "stores.json";
constexpr std::size_t kCopied = std::size_t{1} << 20;

/// Returns the contents of stores.json; null unless terrace published the folder.
nlohmann::json list_of(const fs::path& folder) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;
  try {
    const auto file = stream::open_file(folder / kMark);
    if (file->size() > kMostBytes) return nullptr;
    std::string text(file->size(), '\0');
    file->read(0, std::as_writable_bytes(std::span(text)));
    auto json = nlohmann::json::parse(text, nullptr, false);
    if (json.is_object() && json.value("format", "") == "terrace-stores") return json;
  } catch (const std::exception&) {
  }
  return nullptr;
}

/// Returns which files of a published folder are ours: those of the viewer, stores.json, and the
/// folder and start file of each store that it lists.
stream::Ownership ownership_of_site(const fs::path& folder) {
  const nlohmann::json list = list_of(folder);
  if (list.is_null()) return false;
  std::set<std::string, std::less<>> files{kMark}, stores;
  for (const ViewerFile& file : viewer_files()) files.emplace(file.name);
  const auto take = [](const nlohmann::json& name, auto& names) {
    if (name.is_string()) names.insert(name.get<std::string>());
  };
  // Another version may have had different files.
  for (const auto& name : list.value("viewer", nlohmann::json::array())) take(name, files);
  for (const auto& store : list.value("stores", nlohmann::json::array())) {
    if (store.is_object()) take(store.value("name", nlohmann::json()), stores);
  }
  const auto kind = [](const fs::directory_entry& entry) {
    std::error_code gone;
    return entry.symlink_status(gone).type();
  };
  const auto of_store = [&](const fs::directory_entry& entry) -> stream::Ownership {
    std::string name = entry.path().filename().string();
    if (kind(entry) == fs::file_type::directory) {
      return stores.contains(name) ? stream::Store::ownership_of(entry.path()) : false;
    }
    if (kind(entry) != fs::file_type::regular || !name.ends_with(kStartEnding)) return false;
    name.resize(name.size() - std::string_view(kStartEnding).size());
    return stores.contains(name);
  };
  return stream::ownership_of_entries(
      folder, [&](const fs::directory_entry& entry) -> stream::Ownership {
        const std::string name = entry.path().filename().string();
        if (name == "stores" && kind(entry) == fs::file_type::directory) {
          return stream::ownership_of_entries(entry.path(), of_store);
        }
        return kind(entry) == fs::file_type::regular && files.contains(name);
      });
}

/// Writes all files into the folder `staged`, the mark last.
Published fill(std::span<const stream::Store> stores, const fs::path& staged,
               unsigned repack_threads) {
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
  return published;
}

}  // namespace

Published publish(std::span<const stream::Store> stores, const fs::path& folder, bool replace,
                  unsigned repack_threads) {
  stream::AtomicFolder site_folder(folder, kMark,
                                   replace ? stream::Naming(ownership_of_site) : stream::Naming());
  const fs::path &staged = site_folder.folder(), &target = site_folder.target();
  // Check before the work; commit() checks again.
  if (std::error_code error; fs::symlink_status(target, error).type() != fs::file_type::not_found) {
    if (!replace)
      throw stream::Error(target.string(), "exists already")
          .remedy("name another folder, or give --force");
    if (const stream::Ownership found = ownership_of_site(target); !found.ours) {
      throw stream::not_replaced(target.string(), found);
    }
  }
  Published published;
  // Messages name the folder, not files under its temporary name.
  const auto is_ours = [&](const std::string& file) { return file.starts_with(staged.string()); };
  try {
    published = fill(stores, staged, repack_threads);
  } catch (const stream::Error& error) {
    stream::Error::Parts parts = error.parts();
    if (!is_ours(parts.file)) throw;
    parts.file = target.string();
    throw stream::Error(std::move(parts));
  } catch (const fs::filesystem_error& error) {
    if (!is_ours(error.path1().string())) throw;
    throw stream::system_error(target.string(), "cannot be written", error.code().value());
  }
  site_folder.commit();
  return published;
}

}  // namespace terrace::tools
