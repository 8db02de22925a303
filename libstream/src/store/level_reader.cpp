// SPDX-License-Identifier: Apache-2.0
#include "level_reader.hpp"

#include <algorithm>

namespace terrace::stream::store {
namespace {

constexpr const char* kRemedy = "restore the file or build the store anew";
/// About 1.5 KB each.
constexpr std::uint64_t kCachedPages = 4096;
/// About 100 KB each; one set is for about ten million points of level 0.
constexpr std::uint64_t kCachedTables = 32;

Error damaged_file(const InputFile& file, std::uint64_t offset, const std::string& cause) {
  return Error({.file = file.path().string(),
                .where = "byte " + std::to_string(offset),
                .cause = cause,
                .remedy = kRemedy});
}

}  // namespace

LevelReader::LevelReader(const std::filesystem::path& folder, const Manifest& manifest,
                         unsigned level)
    : layout_(manifest.schema, level),
      clusters_(manifest.levels[level].clusters),
      pages_((clusters_ + kPageClusters - 1) / kPageClusters),
      most_points_(manifest.points),
      top_(level + 1 == manifest.levels.size()),
      data_(folder / manifest.levels[level].data.name, manifest.levels[level].data.bytes),
      index_(folder / manifest.levels[level].index.name, manifest.levels[level].index.bytes),
      page_cache_(std::clamp<std::uint64_t>(pages_, 1, kCachedPages)),
      tables_cache_(1) {
  const std::uint64_t size = manifest.levels[level].directory_bytes;
  if (size > index_.size())
    throw damaged_file(index_, 0, "the index is smaller than its directory");
  read_directory(size);
  tables_cache_ =
      SlotCache<DecodingTables>(std::clamp<std::uint64_t>(tables_at_.size(), 1, kCachedTables));
}

void LevelReader::read_directory(std::uint64_t size) {
  const std::uint64_t start = index_.size() - size;
  tail_.resize(size);
  index_.read(start, tail_);
  try {
    if (size < 4 ||
        crc32(ByteView(tail_).first(size - 4)) != load<std::uint32_t>(tail_.data() + size - 4)) {
      throw Damage("the checksum of the directory is wrong");
    }
    ByteReader in(ByteView(tail_).first(size - 4));
    if (in.left() / 8 <= pages_) throw Damage("the directory has too few pages");
    std::uint64_t previous = 0;
    for (std::uint64_t p = 0; p < pages_; ++p) {
      directory_.push_back(in.get<std::uint64_t>());
      if (directory_.back() < previous || directory_.back() > start ||
          (p == 0 && directory_[0] != 0)) {
        throw Damage("the pages of the directory do not follow one another");
      }
      previous = directory_.back();
    }
    directory_.push_back(in.get<std::uint64_t>());
    if (directory_.back() != start) throw Damage("the pages do not end where the directory begins");
    const auto count = in.get<std::uint32_t>();
    for (std::uint32_t t = 0; t < count; ++t) {
      TablesAt at;
      at.first = in.varint();
      at.size = in.varint();
      at.offset = in.offset();
      in.take(at.size);
      if (tables_at_.empty() ? at.first != 0 : at.first < tables_at_.back().first) {
        throw Damage("the tables do not follow one another");
      }
      tables_at_.push_back(at);
    }
    if (in.left() != 0) throw Damage("bytes follow the directory");
    if (tables_at_.empty() && clusters_ > 0) throw Damage("the level has no tables");
  } catch (const Damage& damage) {
    throw damaged_file(index_, start, damage.what());
  }
}

std::shared_ptr<const IndexPage> LevelReader::read_page(std::uint64_t number) const {
  const std::uint64_t start = directory_[number];
  Bytes bytes(directory_[number + 1] - start);
  index_.read(start, bytes);
  try {
    return std::make_shared<const IndexPage>(
        std::move(bytes), static_cast<std::uint32_t>(std::min<std::uint64_t>(
                              kPageClusters, clusters_ - number * kPageClusters)));
  } catch (const Damage& damage) {
    throw damaged_file(index_, start, damage.what());
  }
}

std::shared_ptr<const IndexPage> LevelReader::page(std::uint64_t number) const {
  return page_cache_.get(number, [&] { return read_page(number); });
}

Entry LevelReader::entry(std::uint64_t ordinal, std::uint64_t& offset) const {
  if (ordinal >= clusters_) {
    throw Error({.file = index_.path().string(),
                 .where = {},
                 .cause = "there is no cluster " + std::to_string(layout_.level) + "/" +
                          std::to_string(ordinal) + ", the level has " + std::to_string(clusters_),
                 .remedy = {}});
  }
  const auto page = this->page(ordinal / kPageClusters);
  const auto i = static_cast<std::uint32_t>(ordinal % kPageClusters);
  try {
    offset = page->offset(i);
    return page->entry(i);
  } catch (const Damage& damage) {
    throw damaged_file(index_, directory_[ordinal / kPageClusters], damage.what());
  }
}

std::shared_ptr<const DecodingTables> LevelReader::tables(std::uint64_t ordinal) const {
  const auto next =
      std::upper_bound(tables_at_.begin(), tables_at_.end(), ordinal,
                       [](std::uint64_t value, const TablesAt& at) { return value < at.first; });
  const TablesAt& at = *(next - 1);
  return tables_cache_.get(static_cast<std::uint64_t>(next - 1 - tables_at_.begin()), [&] {
    try {
      return std::make_shared<const DecodingTables>(
          Tables::read(ByteView(tail_).subspan(at.offset, at.size), layout_.contexts()));
    } catch (const Damage& damage) {
      throw damaged_file(index_, index_.size() - tail_.size() + at.offset, damage.what());
    }
  });
}

void LevelReader::check_range(std::uint64_t ordinal, std::uint64_t offset,
                              std::uint64_t size) const {
  if (offset > data_.size() || size > data_.size() - offset) {
    throw damaged(ordinal, "its bytes are said to lie behind the end of the file");
  }
}

Error LevelReader::damaged(std::uint64_t ordinal, const std::string& cause) const {
  return Error({.file = data_.path().string(),
                .where = "cluster " + std::to_string(layout_.level) + "/" + std::to_string(ordinal),
                .cause = cause,
                .remedy = kRemedy});
}

void LevelReader::decode(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset,
                         ByteView bytes, ClusterDecoder& decoder, ClusterPoints& out) const {
  try {
    if (crc16(bytes) != entry.checksum) {
      throw Damage("the checksum of the bytes from " + std::to_string(offset) + " on is wrong");
    }
    if (entry.points > most_points_) throw Damage("a cluster has more points than the store");
    decoder.decode(layout_, *tables(ordinal), entry, bytes, top_, out);
  } catch (const Damage& damage) {
    throw damaged(ordinal, damage.what());
  }
}

void LevelReader::read(std::uint64_t ordinal, ReadSpace& space, ClusterPoints& out) const {
  std::uint64_t offset = 0;
  const Entry entry = this->entry(ordinal, offset);
  check_range(ordinal, offset, entry.bytes);
  space.bytes.resize(entry.bytes + 2 * kPadding);
  data_.read(offset, {space.bytes.data() + kPadding, entry.bytes});
  decode(ordinal, entry, offset, ByteView(space.bytes).subspan(kPadding, entry.bytes),
         space.decoder, out);
}

}  // namespace terrace::stream::store
