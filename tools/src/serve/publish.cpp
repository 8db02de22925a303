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

/// The file that identifies a published folder. It is written last.
constexpr const char* kMarkFile = "stores.json";
constexpr std::size_t kCopyBytes = std::size_t{1} << 20;

/// Returns the contents of stores.json; null unless terrace published the folder.
nlohmann::json read_stores_json(const fs::path& folder) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{64} << 20;
  try {
    const auto file = stream::open_file(folder / kMarkFile);
    if (file->size() > kMaxBytes) return nullptr;
    std::string text(file->size(), '\0');
    file->read(0, std::as_writable_bytes(std::span(text)));
    auto json = nlohmann::json::parse(text, nullptr, false);
    if (json.is_object() && json.value("format", "") == "terrace-stores") return json;
  } catch (const std::exception&) {
  }
  return nullptr;
}

/// Returns whether all files of a folder were published by terrace. These are the viewer's files,
/// stores.json, and the folder and start file of each store that it lists.
stream::Ownership ownership_of_site(const fs::path& folder) {
  const nlohmann::json list = read_stores_json(folder);
  if (list.is_null()) return false;
  std::set<std::string, std::less<>> files{kMarkFile}, stores;
  for (const ViewerFile& file : viewer_files()) files.emplace(file.name);
  const auto add_name = [](const nlohmann::json& name, auto& names) {
    if (name.is_string()) names.insert(name.get<std::string>());
  };
  // Another version of terrace may have published other files of the viewer.
  for (const auto& name : list.value("viewer", nlohmann::json::array())) add_name(name, files);
  for (const auto& store : list.value("stores", nlohmann::json::array())) {
    if (store.is_object()) add_name(store.value("name", nlohmann::json()), stores);
  }
  const auto kind = [](const fs::directory_entry& entry) {
    std::error_code gone;
    return entry.symlink_status(gone).type();
  };
  const auto ownership_in_stores = [&](const fs::directory_entry& entry) -> stream::Ownership {
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
          return stream::ownership_of_entries(entry.path(), ownership_in_stores);
        }
        return kind(entry) == fs::file_type::regular && files.contains(name);
      });
}

/// Writes all files of the site into the folder `staged`, kMarkFile last.
SiteSize write_site(std::span<const stream::Store> stores, const fs::path& staged,
                    unsigned repack_threads) {
  SiteSize size;
  std::vector<std::byte> piece(kCopyBytes);
  const auto copy = [&](const std::string& name, const stream::ByteSource& source) {
    ++size.files;
    size.bytes += source.size();
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
  std::vector<stream::Store> site_stores(stores.begin(), stores.end());
  if (repack_threads > 0) {
    fs::create_directories(staged / "stores");
    const std::vector<std::string> names = site_names(stores);
    for (std::size_t i = 0; i < site_stores.size(); ++i) {
      const fs::path path = staged / "stores" / names[i];
      stream::repack(stores[i], path, /*replace=*/false, repack_threads);
      site_stores[i] = stream::Store::open(path);
    }
  }
  const Site site = make_site(site_stores);
  for (const auto& [name, resource] : site) {
    if (name != kMarkFile) copy(name, *resource.bytes);
  }
  copy(kMarkFile, *site.at(kMarkFile).bytes);
  return size;
}

}  // namespace

SiteSize publish(std::span<const stream::Store> stores, const fs::path& folder, bool replace,
                 unsigned repack_threads) {
  stream::AtomicFolder site_folder(folder, kMarkFile,
                                   replace ? stream::Naming(ownership_of_site) : stream::Naming());
  const fs::path &staged = site_folder.folder(), &target = site_folder.target();
  // Check before the work begins. commit() checks again.
  if (std::error_code error; fs::symlink_status(target, error).type() != fs::file_type::not_found) {
    if (!replace)
      throw stream::Error(target.string(), "exists already")
          .remedy("name another folder, or give --force");
    if (const stream::Ownership ownership = ownership_of_site(target); !ownership.ours) {
      throw stream::not_replaced(target.string(), ownership);
    }
  }
  SiteSize size;
  // Name the folder in messages, not a file under its temporary name.
  const auto is_in_staged = [&](const std::string& file) {
    return file.starts_with(staged.string());
  };
  try {
    size = write_site(stores, staged, repack_threads);
  } catch (const stream::Error& error) {
    stream::Error::Parts parts = error.parts();
    if (!is_in_staged(parts.file)) throw;
    parts.file = target.string();
    throw stream::Error(std::move(parts));
  } catch (const fs::filesystem_error& error) {
    if (!is_in_staged(error.path1().string())) throw;
    throw stream::system_error(target.string(), "cannot be written", error.code().value());
  }
  site_folder.commit();
  return size;
}

}  // namespace terrace::tools
