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
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "store/codec/tables.hpp"
#include "store/manifest.hpp"
#include "store/read/directory.hpp"
#include "store/read/index_page.hpp"

/// Stores as bytes in memory that tests and fuzzers modify. update_checksums() recomputes all
/// checksums, so that the code after their checks is reached.

namespace terrace::stream::testing {

/// Contents by name in the store's folder.
using StoreFiles = std::map<std::string, std::string>;

inline StoreFiles read_files(const std::filesystem::path& folder) {
  StoreFiles files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream in(entry.path(), std::ios::binary);
    files[entry.path().filename().string()] = {std::istreambuf_iterator<char>(in), {}};
  }
  return files;
}

/// Writes the files to an existing folder.
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

/// A part of the index: its begin, and its end including the checksum.
struct Part {
  std::size_t begin = 0, end = 0;
};

/// The index and data of a level, with the parts that can be found.
struct LevelBytes {
  std::string& data;
  std::string& index;
  std::size_t clusters = 0, directory_bytes = 0;
  store::Layout layout;
  std::vector<Part> page_parts{}, contents{}, sets{};
  std::vector<std::uint64_t> set_firsts{};  ///< the first clusters of the sets

  [[nodiscard]] std::size_t pages() const {
    return (clusters + layout.page_clusters() - 1) / layout.page_clusters();
  }
  [[nodiscard]] std::size_t directory() const { return index.size() - directory_bytes; }
  [[nodiscard]] std::uint32_t clusters_of(std::size_t page) const {
    return static_cast<std::uint32_t>(
        std::min<std::size_t>(layout.page_clusters(), clusters - layout.page_clusters() * page));
  }
  [[nodiscard]] store::ByteView bytes(const Part& part) const {
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(index.data());
    return {begin + part.begin, begin + part.end};
  }
  /// Returns the tables of the page's first cluster. Throws: Damage.
  [[nodiscard]] store::Tables tables_of(std::size_t page) const {
    std::size_t set = 0;
    while (set + 1 < sets.size() && set_firsts[set + 1] <= layout.page_clusters() * page) ++set;
    if (sets.empty()) throw store::Damage("no tables");
    const store::ByteView found = bytes(sets[set]);
    return store::Tables::read(found.first(found.size() - 4), layout);
  }

  /// Writes the checksum of a page.
  void sign_page(std::size_t page) {
    const Part part = page_parts[page];
    const std::uint16_t checksum = store::crc16(bytes({part.begin, part.end - 2}));
    std::memcpy(&index[part.end - 2], &checksum, 2);
  }
  /// Finds the parts, as far as the bytes are valid.
  void find() {
    try {
      store::ByteReader in(bytes({directory(), index.size()}));
      find_parts(in);
    } catch (const store::Damage&) {
    }
  }

 private:
  Part part(std::uint64_t begin, std::uint64_t bytes, std::uint64_t min_bytes) const {
    if (bytes < min_bytes || begin > index.size() || bytes > index.size() - begin)
      throw store::Damage("not in the file");
    return {static_cast<std::size_t>(begin), static_cast<std::size_t>(begin + bytes)};
  }
  void find_parts(store::ByteReader& in) {
    const std::size_t chapters = (pages() + store::kChapterPages - 1) / store::kChapterPages;
    std::uint64_t at = 0;
    std::vector<std::uint64_t> of_contents;
    for (std::size_t c = 0; c < chapters; ++c) {
      at = part(at, in.varint(), 0).end;
      of_contents.push_back(in.varint());
      in.take(12);
    }
    for (const std::uint64_t size : of_contents) {
      contents.push_back(part(at, size, 4));
      at += size;
    }
    for (auto remaining = in.varint(); remaining > 0; --remaining) {
      set_firsts.push_back(in.varint());
      sets.push_back(part(at, in.varint() + 4, 4));
      at = sets.back().end;
    }
    std::uint64_t page_at = 0;
    for (const Part& chapter : contents) {
      store::ByteReader of(bytes(chapter).first(chapter.end - chapter.begin - 4));
      for (std::size_t p = 0; p < store::kChapterPages && page_parts.size() < pages(); ++p) {
        page_parts.push_back(part(page_at, of.varint(), 4));
        page_at = page_parts.back().end;
        of.take(6);
      }
    }
  }
};

/// The parts of an index, which can be changed and put together again.
struct IndexParts {
  struct Page {
    std::string bytes, box;
  };
  std::vector<Page> pages;
  std::vector<std::string> chapter_boxes;
  std::vector<std::pair<std::uint64_t, std::string>> sets;  ///< of tables, without checksums

  explicit IndexParts(const LevelBytes& level) {
    const auto text = [&](const Part& part) {
      return level.index.substr(part.begin, part.end - part.begin);
    };
    store::ByteReader in(level.bytes({level.directory(), level.index.size()}));
    for (const Part& chapter : level.contents) {
      in.varint();
      in.varint();
      chapter_boxes.emplace_back(level.index, level.directory() + in.offset(), 12);
      in.take(12);
      store::ByteReader of(level.bytes(chapter));
      while (of.remaining() > 4) {
        of.varint();
        const std::string box(level.index, chapter.begin + of.offset(), 6);
        of.take(6);
        pages.push_back({text(level.page_parts[pages.size()]), box});
      }
    }
    for (std::size_t s = 0; s < level.sets.size(); ++s) {
      const std::string set = text(level.sets[s]);
      sets.emplace_back(level.set_firsts[s], set.substr(0, set.size() - 4));
    }
  }
  /// Sets the index and directory_bytes of `level`.
  void assemble(LevelBytes& level) const {
    std::string all_pages, all_contents, all_sets;
    store::Bytes directory;
    const auto append = [](std::string& to, const store::Bytes& bytes) {
      to.append(bytes.begin(), bytes.end());
    };
    for (std::size_t c = 0; c < chapter_boxes.size(); ++c) {
      store::Bytes contents;
      std::size_t size = 0;
      for (std::size_t p = c * store::kChapterPages;
           p < std::min<std::size_t>(pages.size(), (c + 1) * store::kChapterPages); ++p) {
        store::put_varint(contents, pages[p].bytes.size());
        contents.insert(contents.end(), pages[p].box.begin(), pages[p].box.end());
        all_pages += pages[p].bytes;
        size += pages[p].bytes.size();
      }
      store::put(contents, store::crc32(contents));
      append(all_contents, contents);
      store::put_varint(directory, size);
      store::put_varint(directory, contents.size());
      directory.insert(directory.end(), chapter_boxes[c].begin(), chapter_boxes[c].end());
    }
    store::put_varint(directory, sets.size());
    for (const auto& [first, set] : sets) {
      store::put_varint(directory, first);
      store::put_varint(directory, set.size());
      store::Bytes bytes(set.begin(), set.end());
      store::put(bytes, store::crc32(bytes));
      append(all_sets, bytes);
    }
    store::put(directory, store::crc32(directory));
    level.index = all_pages + all_contents + all_sets;
    append(level.index, directory);
    level.directory_bytes = directory.size();
  }
};

inline void update_cluster_checksums(LevelBytes& level, std::size_t page) {
  const Part part = level.page_parts[page];
  try {
    const store::Tables tables = level.tables_of(page);
    const store::DecodingTables decoding(tables);
    const std::uint32_t clusters = level.clusters_of(page);
    store::CodedPage coded = store::read_page(level.bytes(part), clusters, level.layout, decoding);
    std::uint64_t begin = coded.offset;
    for (std::uint32_t i = 0; i < clusters; ++i) {
      const std::uint64_t size = coded.entries.column(store::PageColumns::kBytes)[i];
      const bool exists = begin <= level.data.size() && size <= level.data.size() - begin;
      const auto* const bytes = reinterpret_cast<const std::uint8_t*>(level.data.data());
      coded.entries.column(store::PageColumns::kChecksum)[i] =
          exists ? level.layout.checksum({bytes + begin, static_cast<std::size_t>(size)})
                 : std::uint16_t{0};
      begin += size;
    }
    store::Bytes encoded;
    store::PageContent{coded.offset, coded.entries,
                       store::read_ranges(coded.ranges, clusters, level.layout, decoding)}
        .write(level.layout, store::EncodingTables(tables), encoded);
    if (encoded.size() == part.end - part.begin) {
      std::memcpy(&level.index[part.begin], encoded.data(), encoded.size());
    }
  } catch (const store::Damage&) {
    return;  // not a page
  }
  level.sign_page(page);
}

/// Visits the levels whose files exist. manifest: as JSON; its sizes of directories and numbers of
/// clusters may be wrong.
inline void for_each_level(StoreFiles& files, nlohmann::ordered_json& manifest,
                           const std::function<void(LevelBytes&, nlohmann::ordered_json&)>& use) {
  if (!manifest.contains("levels") || !manifest["levels"].is_array()) return;
  Schema schema;
  try {
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
    const store::Layout layout(schema, number++);
    try {
      auto& segment = level.at("segments").at(0);
      const auto data = files.find(segment.at("data").at("file").get<std::string>());
      const auto index = files.find(segment.at("index").at("file").get<std::string>());
      if (data == files.end() || index == files.end() || data == index) continue;
      LevelBytes bytes{data->second, index->second, level.at("clusters").get<std::size_t>(),
                       segment.at("directory_bytes").get<std::size_t>(), layout};
      if (bytes.directory_bytes < 4 || bytes.directory_bytes > bytes.index.size()) continue;
      bytes.find();
      use(bytes, segment);
    } catch (const nlohmann::json::exception&) {
      continue;  // not a level
    }
  }
}

/// Corrects sizes and checksums: of clusters, pages, directories, files and the manifest. Files too
/// damaged to locate their parts stay as they are.
inline void update_checksums(StoreFiles& files) {
  std::string& text = files[kManifestName];
  auto manifest = nlohmann::ordered_json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!manifest.is_object()) return;
  for_each_level(files, manifest, [](LevelBytes& level, nlohmann::ordered_json& segment) {
    for (std::size_t page = 0; page < level.page_parts.size(); ++page) {
      level.sign_page(page);
      update_cluster_checksums(level, page);
    }
    for (const Part& part : level.contents) sign(level.index, part.begin, part.end);
    for (const Part& part : level.sets) sign(level.index, part.begin, part.end);
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

/// Calls edit(manifest) and updates the checksums.
inline void edit_manifest(StoreFiles& files,
                          const std::function<void(nlohmann::ordered_json&)>& edit) {
  auto manifest = nlohmann::ordered_json::parse(files[kManifestName]);
  edit(manifest);
  files[kManifestName] = manifest.dump(2) + "\n";
  update_checksums(files);
}

/// Calls edit(entries, offset of the first in the data file) for a page of a level, writes the
/// result, moves the bytes after it, and updates the checksums.
inline void edit_page(StoreFiles& files, unsigned level, std::size_t page,
                      const std::function<void(std::vector<store::Entry>&, std::uint64_t&)>& edit) {
  auto manifest = nlohmann::ordered_json::parse(files[kManifestName]);
  unsigned number = 0;
  for_each_level(files, manifest, [&](LevelBytes& bytes, nlohmann::ordered_json& segment) {
    if (number++ != level) return;
    const store::Tables tables = bytes.tables_of(page);
    const store::DecodingTables decoding(tables);
    const store::IndexPage old(bytes.bytes(bytes.page_parts[page]), bytes.clusters_of(page),
                               bytes.layout, decoding);
    std::vector<store::Entry> entries;
    for (std::uint32_t i = 0; i < old.clusters(); ++i) entries.push_back(old.entry(i));
    std::uint64_t offset = old.offset(0);
    edit(entries, offset);
    store::Bytes encoded;
    store::PageContent{offset, store::PageColumns(entries), old.ranges(bytes.layout, decoding)}
        .write(bytes.layout, store::EncodingTables(tables), encoded);
    IndexParts parts(bytes);
    parts.pages[page].bytes.assign(encoded.begin(), encoded.end());
    parts.assemble(bytes);
    segment["directory_bytes"] = bytes.directory_bytes;
  });
  files[kManifestName] = manifest.dump(2) + "\n";
  update_checksums(files);
}

}  // namespace terrace::stream::testing
