// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "store/codec/tables.hpp"
#include "store/manifest.hpp"
#include "store/read/index_page.hpp"

/// Stores as bytes in memory that can be modified arbitrarily: mend() recomputes all checksums, so
/// that the code after them is reached. For tests and for the fuzzer.

namespace terrace::stream::testing {

/// By name within the store's folder.
using StoreFiles = std::map<std::string, std::string>;

inline StoreFiles read_files(const std::filesystem::path& folder) {
  StoreFiles files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream in(entry.path(), std::ios::binary);
    files[entry.path().filename().string()] = {std::istreambuf_iterator<char>(in), {}};
  }
  return files;
}

/// Writes into an existing folder.
inline void write_files(const std::filesystem::path& folder, const StoreFiles& files) {
  for (const auto& [name, bytes] : files) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }
}

inline std::uint32_t crc32_of(const std::string& bytes, std::size_t begin, std::size_t end) {
  return store::crc32(0, bytes.data() + begin, end - begin);
}

/// Writes the CRC-32 of [begin, end - 4) after it.
inline void sign(std::string& bytes, std::size_t begin, std::size_t end) {
  const std::uint32_t checksum = crc32_of(bytes, begin, end - 4);
  std::memcpy(bytes.data() + end - 4, &checksum, 4);
}

/// One level's index and data as far as they can be found.
struct LevelBytes {
  std::string& data;
  std::string& index;
  std::size_t clusters = 0, directory_bytes = 0;
  store::Layout layout;

  [[nodiscard]] std::size_t pages() const {
    return (clusters + layout.page_clusters() - 1) / layout.page_clusters();
  }
  [[nodiscard]] std::size_t directory() const { return index.size() - directory_bytes; }
  [[nodiscard]] std::uint32_t clusters_of(std::size_t page) const {
    return static_cast<std::uint32_t>(
        std::min<std::size_t>(layout.page_clusters(), clusters - layout.page_clusters() * page));
  }
  [[nodiscard]] std::uint64_t page_offset(std::size_t page) const {
    std::uint64_t offset = 0;
    std::memcpy(&offset, index.data() + directory() + 8 * page, 8);
    return offset;
  }
  /// Whether the directory has an offset for this page, and the page lies before the directory.
  [[nodiscard]] bool has_page(std::size_t page) const {
    return 8 * page + 20 <= directory_bytes && page_offset(page) <= page_offset(page + 1) &&
           page_offset(page + 1) <= directory() && page_offset(page + 1) - page_offset(page) >= 4;
  }
  [[nodiscard]] store::ByteView page_bytes(std::size_t page) const {
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(index.data());
    return {begin + page_offset(page), begin + page_offset(page + 1)};
  }
  /// Where the number of sets of tables is, within the directory.
  [[nodiscard]] std::size_t sets() const {
    return 8 * (pages() + 1) + (layout.version > 3 ? store::kPageBoxBytes * pages() : 0);
  }
  /// The tables of the page's first cluster. Throws: Damage.
  [[nodiscard]] store::Tables tables_of(std::size_t page) const {
    store::ByteReader in(
        {reinterpret_cast<const std::uint8_t*>(index.data()) + directory(), directory_bytes});
    in.take(sets());
    store::ByteView found;
    for (auto left = in.get<std::uint32_t>(); left > 0; --left) {
      if (in.varint() > layout.page_clusters() * page) break;
      found = in.take(store::memory_size(in.varint()));
    }
    return store::Tables::read(found, layout);
  }
};

/// In old pages the checksum column, the twelfth, is 16 bits wide in everything the library wrote.
inline void mend_old_checksums(LevelBytes& level, std::size_t page, const store::Bytes& checksums) {
  const std::size_t begin = level.page_offset(page), count = level.clusters_of(page);
  // Where the columns begin, and how many bits precede the checksums.
  store::ByteReader in(level.page_bytes(page));
  in.varint();
  std::size_t bits = 0;
  std::uint64_t base = 0;
  std::uint16_t packed = 0;
  for (unsigned column = 0; column < 12; ++column) {
    bits += std::size_t{packed} % 256 * count;
    base = in.varint();
    packed = in.get<std::uint16_t>();
  }
  for (std::size_t end_of_range = 0; end_of_range < 2 * level.layout.ranges(); ++end_of_range) {
    in.varint();
    in.get<std::uint16_t>();
  }
  if (base != 0 || packed != 16) return;
  for (std::size_t b = 0; b < 16 * count; ++b) {
    const std::size_t at = 8 * (begin + in.offset()) + bits + b;
    const int bit = checksums[b / 8] >> b % 8 & 1;
    char& byte = level.index[at / 8];
    byte = static_cast<char>((byte & ~(1 << at % 8)) | (bit != 0 ? 1 << at % 8 : 0));
  }
}

inline void mend_cluster_checksums(LevelBytes& level, std::size_t page) {
  const std::size_t begin = level.page_offset(page), end = level.page_offset(page + 1);
  try {
    const bool old = level.layout.version < 4;
    const store::Tables tables = old ? store::Tables() : level.tables_of(page);
    const store::DecodingTables decoding(tables);
    std::uint64_t from = 0;
    store::PageColumns columns = store::read_page(level.page_bytes(page), level.clusters_of(page),
                                                  level.layout, &decoding, from);
    const std::uint64_t offset = from;
    store::Bytes checksums;
    for (std::uint32_t i = 0; i < columns.clusters(); ++i) {
      const std::uint64_t size = columns.column(store::PageColumns::kBytes)[i];
      const bool there = from <= level.data.size() && size <= level.data.size() - from;
      const auto* const bytes = reinterpret_cast<const std::uint8_t*>(level.data.data());
      const auto checksum =
          there ? store::crc16({bytes + from, static_cast<std::size_t>(size)}) : std::uint16_t{0};
      store::put(checksums, checksum);
      columns.column(store::PageColumns::kChecksum)[i] = checksum;
      from += size;
    }
    if (old) {
      mend_old_checksums(level, page, checksums);
    } else {
      store::Bytes fresh;
      columns.write(level.layout, store::EncodingTables(tables), offset, fresh);
      if (fresh.size() == end - begin) std::memcpy(&level.index[begin], fresh.data(), fresh.size());
    }
  } catch (const store::Damage&) {
    return;  // no page: nothing to mend
  }
  sign(level.index, begin, end);
}

/// The levels whose files exist. `manifest`: as JSON; its size of a directory and its number of
/// clusters need not be true.
inline void for_each_level(StoreFiles& files, nlohmann::ordered_json& manifest,
                           const std::function<void(LevelBytes&, nlohmann::ordered_json&)>& use) {
  if (!manifest.contains("levels") || !manifest["levels"].is_array()) return;
  Schema schema;
  int version = 0;
  try {
    version = manifest.at("version").get<int>();
    schema.grid = manifest.at("kind") == "grid";
    for (const auto& channel : manifest.at("attributes")) {
      schema.attributes.emplace_back();
      schema.attributes.back().type =
          scalar_type_of(channel.at("type").get<std::string>()).value_or(ScalarType::u8);
    }
  } catch (const nlohmann::json::exception&) {
    return;
  }
  unsigned number = 0;
  for (auto& level : manifest["levels"]) {
    const store::Layout layout(schema, number++, version);
    try {
      auto& segment = level.at("segments").at(0);
      const auto data = files.find(segment.at("data").at("file").get<std::string>());
      const auto index = files.find(segment.at("index").at("file").get<std::string>());
      if (data == files.end() || index == files.end() || data == index) continue;
      LevelBytes bytes{data->second, index->second, level.at("clusters").get<std::size_t>(),
                       segment.at("directory_bytes").get<std::size_t>(), layout};
      if (bytes.directory_bytes < 4 || bytes.directory_bytes > bytes.index.size()) continue;
      use(bytes, segment);
    } catch (const nlohmann::json::exception&) {
      continue;  // not a level
    }
  }
}

/// Corrects sizes and checksums: of clusters, pages, directories, files and the manifest. Files too
/// damaged to locate their parts stay as they are.
inline void mend(StoreFiles& files) {
  std::string& text = files[kManifestName];
  auto manifest = nlohmann::ordered_json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!manifest.is_object()) return;
  for_each_level(files, manifest, [](LevelBytes& level, nlohmann::ordered_json& segment) {
    for (std::size_t page = 0; page < level.pages() && level.has_page(page); ++page) {
      sign(level.index, level.page_offset(page), level.page_offset(page + 1));
      mend_cluster_checksums(level, page);
    }
    sign(level.index, level.directory(), level.index.size());
    for (const auto& [name, bytes] :
         {std::pair<const char*, const std::string&>{"data", level.data}, {"index", level.index}}) {
      segment[name]["bytes"] = bytes.size();
      segment[name]["crc32"] = store::hexadecimal(crc32_of(bytes, 0, bytes.size()));
    }
  });
  manifest["checksum"] = "00000000";
  text = manifest.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  constexpr std::size_t kDigitsFromEnd = 12;  // eight digits, a quote, newline, brace, newline
  const std::string checksum = store::hexadecimal(crc32_of(text, 0, text.size()));
  // If an edit has put a key after the checksum, the manifest keeps a wrong checksum.
  text.replace(text.size() - kDigitsFromEnd, 8, checksum);
}

/// Calls edit(manifest) and mends.
inline void edit_manifest(StoreFiles& files,
                          const std::function<void(nlohmann::ordered_json&)>& edit) {
  auto manifest = nlohmann::ordered_json::parse(files[kManifestName]);
  edit(manifest);
  files[kManifestName] = manifest.dump(2) + "\n";
  mend(files);
}

/// Calls edit(entries, offset of the first in the data file) for a page of a level, writes the
/// result, moves what follows it, and mends.
inline void edit_page(StoreFiles& files, unsigned level, std::size_t page,
                      const std::function<void(std::vector<store::Entry>&, std::uint64_t&)>& edit) {
  auto manifest = nlohmann::ordered_json::parse(files[kManifestName]);
  unsigned number = 0;
  for_each_level(files, manifest, [&](LevelBytes& bytes, nlohmann::ordered_json&) {
    if (number++ != level) return;
    const store::Tables tables = bytes.tables_of(page);
    const store::DecodingTables decoding(tables);
    const store::IndexPage old(bytes.page_bytes(page), bytes.clusters_of(page), bytes.layout,
                               &decoding);
    const std::size_t attributes = bytes.layout.ranges();
    std::vector<store::Entry> entries;
    std::vector<store::KeyRange> ranges;
    for (std::uint32_t i = 0; i < old.clusters(); ++i) {
      entries.push_back(old.entry(i));
      for (std::size_t a = 0; a < attributes; ++a) ranges.push_back(old.range(i, a));
    }
    std::uint64_t offset = old.offset(0);
    edit(entries, offset);
    ranges.resize(entries.size() * attributes);
    store::Bytes fresh;
    const std::vector<ScalarType> types(attributes, ScalarType::i64);
    store::PageColumns(entries, types, ranges)
        .write(bytes.layout, store::EncodingTables(tables), offset, fresh);
    const std::size_t begin = bytes.page_offset(page), end = bytes.page_offset(page + 1);
    for (std::size_t p = page + 1; p <= bytes.pages(); ++p) {
      const std::uint64_t moved = bytes.page_offset(p) - (end - begin) + fresh.size();
      std::memcpy(bytes.index.data() + bytes.directory() + 8 * p, &moved, 8);
    }
    bytes.index.replace(begin, end - begin, reinterpret_cast<const char*>(fresh.data()),
                        fresh.size());
  });
  mend(files);
}

}  // namespace terrace::stream::testing
