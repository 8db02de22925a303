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
/// checksums, so that tests reach the code after the checksum tests.

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

/// Coded sizes of a ChapterBox and a PageBox, in bytes: two numbers per axis.
inline constexpr std::size_t kChapterBoxBytes = 12, kPageBoxBytes = 6;

/// Writes the CRC-32 of [begin, end - 4) to the last four bytes.
inline void put_crc32(std::string& bytes, std::size_t begin, std::size_t end) {
  const std::uint32_t checksum = crc32_of(bytes, begin, end - 4);
  std::memcpy(bytes.data() + end - 4, &checksum, 4);
}

/// A byte range of the index, including its checksum.
struct Part {
  std::size_t begin = 0, end = 0;
};

/// The two files of a level, and the parts of the index that are intact.
struct LevelBytes {
  std::string& data;
  std::string& index;
  std::size_t clusters = 0, directory_bytes = 0;
  store::Layout layout;
  std::vector<Part> pages{}, chapters{}, table_sets{};
  std::vector<std::uint64_t> set_first_clusters{};

  [[nodiscard]] std::size_t page_count() const {
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
    const std::uint64_t first_cluster = layout.page_clusters() * page;
    while (set + 1 < table_sets.size() && set_first_clusters[set + 1] <= first_cluster) ++set;
    if (table_sets.empty()) throw store::Damage("no tables");
    const store::ByteView tables = bytes(table_sets[set]);
    return store::Tables::read(tables.first(tables.size() - 4), layout);
  }

  /// Recomputes the checksum of a page.
  void put_page_crc16(std::size_t page) {
    const Part part = pages[page];
    const std::uint16_t checksum = store::crc16(bytes({part.begin, part.end - 2}));
    std::memcpy(&index[part.end - 2], &checksum, 2);
  }
  /// Locates the parts, up to the first invalid byte.
  void locate_parts() {
    try {
      store::ByteReader in(bytes({directory(), index.size()}));
      locate_parts(in);
    } catch (const store::Damage&) {
    }
  }

 private:
  /// Returns the part of `bytes` bytes from `begin` on. Throws: Damage.
  [[nodiscard]] Part checked_part(std::uint64_t begin, std::uint64_t bytes,
                                  std::uint64_t min_bytes) const {
    if (bytes < min_bytes || begin > index.size() || bytes > index.size() - begin) {
      throw store::Damage("exceeds the file");
    }
    return {static_cast<std::size_t>(begin), static_cast<std::size_t>(begin + bytes)};
  }
  void locate_parts(store::ByteReader& in) {
    const std::size_t chapter_count =
        (page_count() + store::kChapterPages - 1) / store::kChapterPages;
    std::uint64_t offset = 0;
    std::vector<std::uint64_t> chapter_sizes;
    for (std::size_t c = 0; c < chapter_count; ++c) {
      offset = checked_part(offset, in.varint(), 0).end;
      chapter_sizes.push_back(in.varint());
      in.take(kChapterBoxBytes);
    }
    for (const std::uint64_t size : chapter_sizes) {
      chapters.push_back(checked_part(offset, size, 4));
      offset += size;
    }
    for (auto remaining = in.varint(); remaining > 0; --remaining) {
      set_first_clusters.push_back(in.varint());
      table_sets.push_back(checked_part(offset, in.varint() + 4, 4));
      offset = table_sets.back().end;
    }
    std::uint64_t page_offset = 0;
    for (const Part& chapter : chapters) {
      store::ByteReader chapter_reader(bytes(chapter).first(chapter.end - chapter.begin - 4));
      for (std::size_t p = 0; p < store::kChapterPages && pages.size() < page_count(); ++p) {
        pages.push_back(checked_part(page_offset, chapter_reader.varint(), 4));
        page_offset = pages.back().end;
        chapter_reader.take(kPageBoxBytes);
      }
    }
  }
};

/// An index split into its parts, which tests edit and reassemble.
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
    for (const Part& chapter : level.chapters) {
      in.varint();  // size of the pages
      in.varint();  // size of the contents
      chapter_boxes.emplace_back(level.index, level.directory() + in.offset(), kChapterBoxBytes);
      in.take(kChapterBoxBytes);
      store::ByteReader chapter_reader(level.bytes(chapter));
      while (chapter_reader.remaining() > 4) {
        chapter_reader.varint();
        const std::string box(level.index, chapter.begin + chapter_reader.offset(), kPageBoxBytes);
        chapter_reader.take(kPageBoxBytes);
        pages.push_back({text(level.pages[pages.size()]), box});
      }
    }
    for (std::size_t s = 0; s < level.table_sets.size(); ++s) {
      const std::string set = text(level.table_sets[s]);
      sets.emplace_back(level.set_first_clusters[s], set.substr(0, set.size() - 4));
    }
  }
  /// Writes the parts to the index of `level` and sets directory_bytes.
  void assemble(LevelBytes& level) const {
    std::string all_pages, all_contents, all_sets;
    store::Bytes directory;
    const auto append = [](std::string& text, const store::Bytes& bytes) {
      text.append(bytes.begin(), bytes.end());
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

/// Recomputes the checksums of a page and its clusters. Does nothing if the page is damaged.
inline void update_cluster_checksums(LevelBytes& level, std::size_t page) {
  const Part part = level.pages[page];
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
    // A page whose coded length changes keeps the old checksums of its clusters.
    if (encoded.size() == part.end - part.begin) {
      std::memcpy(&level.index[part.begin], encoded.data(), encoded.size());
    }
  } catch (const store::Damage&) {
    return;  // not a page
  }
  level.put_page_crc16(page);
}

/// Calls use() for each level whose files exist. The manifest may be invalid.
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
      bytes.locate_parts();
      use(bytes, segment);
    } catch (const nlohmann::json::exception&) {
      continue;  // not a level
    }
  }
}

/// Recomputes the sizes and checksums of clusters, pages, directories, files and the manifest.
/// Leaves files alone whose parts cannot be located.
inline void update_checksums(StoreFiles& files) {
  std::string& text = files[kManifestName];
  auto manifest = nlohmann::ordered_json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!manifest.is_object()) return;
  for_each_level(files, manifest, [](LevelBytes& level, nlohmann::ordered_json& segment) {
    for (std::size_t page = 0; page < level.pages.size(); ++page) {
      level.put_page_crc16(page);
      update_cluster_checksums(level, page);
    }
    for (const Part& part : level.chapters) put_crc32(level.index, part.begin, part.end);
    for (const Part& part : level.table_sets) put_crc32(level.index, part.begin, part.end);
    put_crc32(level.index, level.directory(), level.index.size());
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
  // Requires that the checksum is the last key; otherwise it stays wrong.
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

/// Calls edit(entries, offset) for a page of a level, rebuilds the index and updates the checksums.
/// offset: of the first cluster in the data file.
inline void edit_page(StoreFiles& files, unsigned level, std::size_t page,
                      const std::function<void(std::vector<store::Entry>&, std::uint64_t&)>& edit) {
  auto manifest = nlohmann::ordered_json::parse(files[kManifestName]);
  unsigned number = 0;
  for_each_level(files, manifest, [&](LevelBytes& bytes, nlohmann::ordered_json& segment) {
    if (number++ != level) return;
    const store::Tables tables = bytes.tables_of(page);
    const store::DecodingTables decoding(tables);
    const store::IndexPage old(bytes.bytes(bytes.pages[page]), bytes.clusters_of(page),
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
