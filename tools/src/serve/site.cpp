// SPDX-License-Identifier: GPL-3.0-or-later
#include "serve/site.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <mutex>
#include <new>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <zlib.h>

#include "serve/viewer_files.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/store_view.hpp"

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kManifest = "manifest.json";
/// Interval between checks of all files, and between attempts to rebuild the site.
constexpr std::chrono::milliseconds kCheckInterval{100};
/// Number of attempts to build the first site while files are changing.
constexpr int kAttempts = 20;

/// Returns the media type of a file by its ending.
std::string media_type(const std::string& name) {
  static constexpr std::pair<std::string_view, std::string_view> kTypes[] = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".wasm", "application/wasm"},
  };
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) return std::string(type);
  }
  return "application/octet-stream";
}

std::string hexadecimal(std::uint64_t value) {
  std::string text;
  do {
    text.insert(text.begin(), "0123456789abcdef"[value & 15]);
    value >>= 4;
  } while (value > 0);
  return text;
}

/// Returns the FNV-1a hash (RFC 9923).
std::uint64_t hash_of(std::string_view bytes) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3;
  return hash;
}

/// Adds a file with this text to the site.
Resource& add_text(Site& site, const std::string& name, std::string_view text) {
  std::vector<std::byte> bytes(text.size());
  std::transform(text.begin(), text.end(), bytes.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  return site[name] = {stream::bytes_in_memory(name, std::move(bytes)), media_type(name),
                       '"' + hexadecimal(hash_of(text)) + '"'};
}

/// Returns the names of the manifest and of the files that it lists.
std::vector<std::string> files_of(const stream::Store& store) {
  const auto source = stream::open_file(store.path() / kManifest);
  std::string text(source->size(), '\0');
  source->read(0, std::as_writable_bytes(std::span(text)));
  std::vector<std::string> names{kManifest};
  const Json manifest = Json::parse(text);
  for (const Json& level : manifest.at("levels")) {
    for (const Json& segment : level.at("segments")) {
      for (const char* part : {"data", "index"}) {
        names.push_back(segment.at(part).at("file").get<std::string>());
      }
    }
  }
  if (manifest.contains("surface")) {
    names.push_back(manifest.at("surface").at("data").at("file").get<std::string>());
  }
  return names;
}

/// Returns the name of a store in a site that contains stores with the names `taken`.
std::string name_of(const stream::Store& store, const std::vector<std::string>& taken) {
  fs::path path = fs::absolute(store.path()).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  std::string name = path.filename().string();
  // Cut all endings, so that a copy under the resulting name gets the same name again.
  const auto cut = [&](std::string_view ending) {
    if (name.size() <= ending.size() || !name.ends_with(ending)) return false;
    name.resize(name.size() - ending.size());
    return true;
  };
  while (cut(".store") || cut(".terrace")) {
  }
  // Keep to names that every web server serves unchanged.
  for (char& c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || (c == '.' && &c != name.data());
    if (!plain) c = '_';
  }
  std::string unique = name;
  // A store takes a folder of that name and a file next to it.
  const auto is_taken = [&] {
    return std::any_of(taken.begin(), taken.end(), [&](const std::string& other) {
      return unique == other || unique == other + kStartEnding || other == unique + kStartEnding;
    });
  };
  for (int i = 2; is_taken(); ++i) unique = fmt::format("{}-{}", name, i);
  return unique;
}

/// The ranges that were read of a store's files.
struct ReadRanges {
  std::mutex mutex;
  /// By file and offset: the end of the longest range there.
  std::map<std::string, std::map<std::uint64_t, std::uint64_t>> ends;

  void add(const std::string& file, std::uint64_t offset, std::uint64_t bytes) {
    const std::lock_guard lock(mutex);
    std::uint64_t& end = ends[file][offset];
    end = std::max(end, offset + bytes);
  }
};

/// Returns the bytes compressed in zlib format (RFC 1950), which browsers decompress.
std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string result(size, '\0');
  const auto* in = reinterpret_cast<const Bytef*>(bytes.data());
  auto* out = reinterpret_cast<Bytef*>(result.data());
  if (compress2(out, &size, in, static_cast<uLong>(bytes.size()), Z_BEST_COMPRESSION) != Z_OK) {
    throw std::bad_alloc();
  }
  result.resize(size);
  return result;
}

/// Returns the class that an attribute value means; values outside 0 to 255 are clamped.
std::uint8_t class_of_value(double value) {
  return value > 0 ? static_cast<std::uint8_t>(std::min(value, 255.0)) : 0;
}

/// Returns the classes of a cloud's points in ascending order, for a legend. Returns nullopt if
/// there are none or finding them takes too long. Reads only clusters whose range of values
/// contains a class not found yet.
std::optional<std::vector<int>> classes_of(const stream::Store& store) {
  constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 26;
  const stream::StoreSchema& schema = store.schema();
  if (schema.grid || store.points() > kMaxPoints) return std::nullopt;
  std::size_t number = 0;
  const auto find = [&](std::string_view name) {
    const auto is_it = [&](const stream::Channel& channel) { return channel.name == name; };
    number = static_cast<std::size_t>(
        std::find_if(schema.attributes.begin(), schema.attributes.end(), is_it) -
        schema.attributes.begin());
    return number < schema.attributes.size();
  };
  // The viewer looks for the same names.
  if (!find("classification") && !find("class")) return std::nullopt;
  const stream::ScalarType type = schema.attributes[number].type;
  const std::size_t offset = schema.attribute_offset(number), bytes = schema.payload_size();
  std::array<bool, 256> seen{};
  stream::ClusterPoints points;
  for (const stream::LevelInfo& level : store.levels()) {
    for (std::uint64_t i = 0; i < level.clusters; ++i) {
      const stream::ClusterId id = stream::cluster_id(level.level, i);
      const stream::ValueRange range = store.attribute_ranges(id)[number];
      const auto first = seen.begin() + class_of_value(range.low);
      const auto end = seen.begin() + class_of_value(range.high) + 1;
      if (!range.nan && first < end && std::all_of(first, end, std::identity())) continue;
      store.read(id, points);
      for (std::size_t at = offset; at < points.payload.size(); at += bytes) {
        seen[class_of_value(stream::to_double(type, points.payload.data() + at))] = true;
      }
    }
  }
  std::vector<int> classes;
  for (int c = 0; c < 256; ++c) {
    if (seen[static_cast<std::size_t>(c)]) classes.push_back(c);
  }
  return classes;
}

/// Returns the map from stored coordinates to the ground as a view of samples of this type has it.
template <class Sample>
stream::LinearMap ground_of(const stream::Store& store) {
  using View = terrain::StoreView<Sample>;
  return View(store, {}, View::Reader::in_frame).ground();
}

}  // namespace

std::string start_file(const stream::Store& store) {
  const auto ranges = std::make_shared<ReadRanges>();
  const stream::OpenByName files = [&](const std::string& name) {
    std::shared_ptr<stream::ByteSource> file = stream::open_file(store.path() / name);
    return stream::bytes_by_function(
        file->name(), file->size(),
        [file, name, ranges](std::uint64_t offset, std::span<std::byte> out) {
          ranges->add(name, offset, out.size());
          file->read(offset, out);
        });
  };
  const stream::Store recorded_store = stream::Store::open(store.path().string(), files);
  // This reads the root and the records of the clusters below it, as a view does at its start.
  const Json ground = store.schema().grid ? ground_of<std::int32_t>(recorded_store)
                                          : ground_of<tri::PointCloud>(recorded_store);

  Json parts = Json::array();
  std::string bytes;
  for (const auto& [name, ends] : ranges->ends) {
    const auto file = stream::open_file(store.path() / name);
    for (auto at = ends.begin(); at != ends.end();) {
      const std::uint64_t begin = at->first;
      std::uint64_t end = at->second;
      while (++at != ends.end() && at->first <= end) end = std::max(end, at->second);
      if (begin == end) continue;
      parts.push_back({name, begin, end - begin});
      const std::size_t size = bytes.size();
      bytes.resize(size + (end - begin));
      file->read(begin, std::as_writable_bytes(std::span(bytes).subspan(size)));
    }
  }
  Json head = {{"format", "terrace-start"}, {"version", 2}, {"ground", ground}, {"parts", parts}};
  if (const auto classes = classes_of(store)) head["classes"] = *classes;
  return head.dump() + "\n" + compressed(bytes);
}

std::vector<std::string> site_names(std::span<const stream::Store> stores) {
  std::vector<std::string> names;
  for (const stream::Store& store : stores) names.push_back(name_of(store, names));
  return names;
}

Site make_site(std::span<const stream::Store> stores) {
  Site site;
  for (const ViewerFile& file : viewer_files()) {
    add_text(site, std::string(file.name), file.bytes).open_to_all = true;
  }
  Json list = Json::array();
  const std::vector<std::string> names = site_names(stores);
  for (std::size_t i = 0; i < stores.size(); ++i) {
    const stream::Store& store = stores[i];
    const std::string& name = names[i];
    const std::string folder = fmt::format("stores/{}/", name);
    const std::string checksum = hexadecimal(store.checksum());
    for (const std::string& file : files_of(store)) {
      const fs::path path = store.path() / file;
      std::error_code error;
      if (!fs::is_regular_file(fs::symlink_status(path, error))) {
        throw stream::Error(path.string(), "is not a regular file (links are not served)")
            .remedy("replace it with the file itself");
      }
      std::shared_ptr<const stream::ByteSource> bytes = stream::open_file(path);
      const std::string tag = fmt::format("\"{}-{}\"", checksum, hexadecimal(bytes->size()));
      site[folder + file] = {std::move(bytes), media_type(file), tag};
    }
    add_text(site, "stores/" + name + kStartEnding, start_file(store));
    list.push_back({{"name", name}, {"points", store.points()}, {"checksum", checksum}});
  }
  Json viewer = Json::array();
  for (const ViewerFile& file : viewer_files()) viewer.push_back(file.name);
  const Json stores_json = {
      {"format", "terrace-stores"}, {"version", 1}, {"stores", list}, {"viewer", viewer}};
  add_text(site, "stores.json", stores_json.dump(1) + "\n");
  return site;
}

LiveSite::LiveSite(std::vector<std::string> paths,
                   std::function<stream::Store(const std::string& path)> open)
    : paths_(std::move(paths)), open_(std::move(open)) {
  for (const std::string& path : paths_) manifests_.push_back(fs::path(path) / kManifest);
  for (int attempts = 1; !rebuild(); ++attempts) {
    if (attempts < kAttempts) continue;
    throw stream::Error(paths_.front(), "the files of a store keep changing")
        .remedy("wait until they have been copied");
  }
}

const Site& LiveSite::current() {
  const std::vector<Stamp> manifests = stamps(manifests_);
  const Clock::time_point begin = Clock::now();
  const bool replaced = manifests != (last_attempt_failed_ ? attempted_stamps_ : manifest_stamps_);
  if (!replaced && begin < next_check_) return site_;
  next_check_ = begin + kCheckInterval;
  if (!replaced && !last_attempt_failed_ && stamps(files_) == file_stamps_) return site_;
  attempted_stamps_ = manifests;
  try {
    last_attempt_failed_ = !rebuild();
  } catch (const stream::Stopped&) {
    throw;
  } catch (const std::exception&) {
    last_attempt_failed_ = true;  // A store is missing, damaged, or still being copied.
  }
  const Clock::time_point end = Clock::now();
  next_check_ = end + std::max<Clock::duration>(kCheckInterval, 3 * (end - begin));
  return site_;
}

LiveSite::Stamp LiveSite::stamp(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return {static_cast<std::int64_t>(status.st_dev), static_cast<std::int64_t>(status.st_ino),
          status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

std::vector<LiveSite::Stamp> LiveSite::stamps(std::span<const fs::path> files) {
  std::vector<Stamp> stamps(files.size());
  std::transform(files.begin(), files.end(), stamps.begin(), stamp);
  return stamps;
}

bool LiveSite::rebuild() {
  std::vector<Stamp> manifests = stamps(manifests_);
  std::vector<stream::Store> stores;
  std::vector<fs::path> files;
  for (const std::string& path : paths_) {
    stores.push_back(open_(path));
    for (const std::string& name : files_of(stores.back())) {
      if (name != kManifest) files.push_back(fs::path(path) / name);
    }
  }
  std::vector<Stamp> others = stamps(files);
  Site site = make_site(stores);
  if (stamps(manifests_) != manifests || stamps(files) != others) return false;
  site_ = std::move(site);
  files_ = std::move(files);
  manifest_stamps_ = std::move(manifests);
  file_stamps_ = std::move(others);
  return true;
}

}  // namespace terrace::tools
