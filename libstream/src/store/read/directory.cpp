// SPDX-License-Identifier: Apache-2.0
#include "store/read/directory.hpp"

#include <utility>

#include "store/read/index_page.hpp"

namespace terrace::stream::store {
namespace {

/// Contents of chapters and tables of at most this many bytes are read with the directory.
constexpr std::uint64_t kMaxCacheBytes = std::uint64_t{64} << 10;
/// A writer makes one set per 1024 blocks, each of which has a cluster.
constexpr std::uint64_t kMinClustersOfTables = 1024;
constexpr std::uint64_t kMaxVarint = 10, kChecksum = 4;

/// Checks the CRC-32 at the end of `bytes`. Returns the bytes before it.
ByteView checked(ByteView bytes, const char* damage) {
  if (bytes.size() < kChecksum ||
      crc32(bytes.first(bytes.size() - kChecksum)) !=
          load<std::uint32_t>(bytes.data() + bytes.size() - kChecksum)) {
    throw Damage(damage);
  }
  return bytes.first(bytes.size() - kChecksum);
}

}  // namespace

Directory::Directory(const ByteSource& index, std::uint64_t bytes, std::uint64_t clusters,
                     const Layout& layout, const Box3& bounds)
    : index_(index),
      clusters_(clusters),
      pages_(clusters / layout.page_clusters() + (clusters % layout.page_clusters() != 0)),
      attributes_(layout.attributes.size()),
      bounds_(bounds) {
  const std::uint64_t max_tables = 1 + clusters / kMinClustersOfTables;
  if (bytes > 64 * (1 + pages_ / kChapterPages) + max_tables * 2 * kMaxVarint) {
    throw Damage("the directory is too large for the level's clusters");
  }
  const std::uint64_t start = index_.size() - bytes;
  cache_offset_ = start;
  cache_ = read(start, bytes);
  ByteReader in(checked(cache_, "the checksum of the directory is wrong"));
  read_chapters(in, start);
  contents_ = std::vector<std::atomic<const Contents*>>(chapters_.size());
  const std::uint64_t tail = chapters_.front().contents_at;
  cache_ = start - tail > kMaxCacheBytes ? Bytes() : read(tail, start - tail);
  cache_offset_ = tail;
}

Directory::~Directory() {
  for (const auto& contents : contents_) delete contents.load();
}

void Directory::read_chapters(ByteReader& in, std::uint64_t start) {
  const std::uint64_t chapters = (pages_ + kChapterPages - 1) / kChapterPages;
  std::uint64_t pages_end = 0, contents_bytes = 0;
  for (std::uint64_t c = 0; c < chapters; ++c) {
    const std::uint64_t pages = std::min(kChapterPages, pages_ - c * kChapterPages);
    Chapter chapter;
    const std::uint64_t pages_bytes = in.varint(), contents_size = in.varint();
    if (pages_bytes > pages * max_page_bytes(attributes_) || pages_bytes > start - pages_end) {
      throw Damage("the pages of a chapter have an impossible size");
    }
    if (contents_size < 7 * pages + kChecksum || contents_size > 16 * pages + kChecksum) {
      throw Damage("the contents of a chapter have an impossible size");
    }
    chapter.pages_at = pages_end;
    chapter.pages_end = pages_end += pages_bytes;
    chapter.contents_at = contents_bytes;
    chapter.contents_bytes = static_cast<std::size_t>(contents_size);
    contents_bytes += contents_size;
    ChapterBox box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = in.get<std::uint16_t>();
      box.high[axis] = in.get<std::uint16_t>();
    }
    chapter.box = box.in(bounds_);
    chapters_.push_back(chapter);
  }
  if (contents_bytes > start - pages_end) {
    throw Damage("the contents of the chapters are larger than the index");
  }
  for (Chapter& chapter : chapters_) chapter.contents_at += pages_end;
  read_sets(in, pages_end + contents_bytes);
  if (tables_.back().offset + tables_.back().size + kChecksum != start) {
    throw Damage("the tables do not end where the directory begins");
  }
}

/// Reads the positions of the sets of tables. at: the offset of the first set in the index.
void Directory::read_sets(ByteReader& in, std::uint64_t at) {
  const std::uint64_t sets = in.varint();
  for (std::uint64_t t = 0; t < sets; ++t) {
    TablesPosition set;
    set.first = in.varint();
    const std::uint64_t size = in.varint();
    if (size > index_.size() - at || kChecksum > index_.size() - at - size) {
      throw Damage("tables exceed the end of the index");
    }
    set.size = memory_size(size);
    set.offset = at;
    at += size + kChecksum;
    if (tables_.empty() ? set.first != 0 : set.first <= tables_.back().first) {
      throw Damage("the tables are not in the order of their clusters");
    }
    if (set.first >= clusters_) throw Damage("tables are for clusters that do not exist");
    tables_.push_back(set);
  }
  if (in.remaining() != 0) throw Damage("bytes follow the directory");
  if (tables_.empty()) throw Damage("the level has no tables");
}

Bytes Directory::read(std::uint64_t offset, std::uint64_t size) const {
  Bytes bytes(memory_size(size));
  if (offset >= cache_offset_ && offset - cache_offset_ <= cache_.size() &&
      size <= cache_.size() - (offset - cache_offset_)) {
    std::copy_n(cache_.begin() + static_cast<std::ptrdiff_t>(offset - cache_offset_), size,
                bytes.begin());
  } else {
    index_.read(offset, std::as_writable_bytes(std::span(bytes)));
  }
  return bytes;
}

const Directory::Contents& Directory::contents(std::uint64_t number) const {
  std::atomic<const Contents*>& cached = contents_[static_cast<std::size_t>(number)];
  if (const Contents* const contents = cached.load(std::memory_order_acquire)) return *contents;
  const Chapter& chapter = chapters_[static_cast<std::size_t>(number)];
  const Bytes bytes = read(chapter.contents_at, chapter.contents_bytes);
  ByteReader in(checked(bytes, "the checksum of a chapter's contents is wrong"));
  auto contents = std::make_unique<Contents>();
  std::uint64_t offset = chapter.pages_at;
  const std::uint64_t pages = std::min(kChapterPages, pages_ - number * kChapterPages);
  for (std::uint64_t p = 0; p < pages; ++p) {
    contents->offsets.push_back(offset);
    const std::uint64_t size = in.varint();
    if (size > max_page_bytes(attributes_) || size > chapter.pages_end - offset) {
      throw Damage("the sizes of a chapter's pages do not add up");
    }
    offset += size;
    PageBox& box = contents->boxes.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = in.get<std::uint8_t>();
      box.high[axis] = in.get<std::uint8_t>();
    }
  }
  contents->offsets.push_back(offset);
  if (offset != chapter.pages_end) throw Damage("the sizes of a chapter's pages do not add up");
  if (in.remaining() != 0) throw Damage("bytes follow the contents of a chapter");
  const std::lock_guard lock(mutex_);
  if (cached.load(std::memory_order_relaxed) == nullptr) {
    cached.store(contents.release(), std::memory_order_release);
  }
  return *cached.load(std::memory_order_relaxed);
}

Directory::Range Directory::page_range(std::uint64_t page) const {
  const std::vector<std::uint64_t>& offsets = contents(page / kChapterPages).offsets;
  const auto index = static_cast<std::size_t>(page % kChapterPages);
  return {offsets[index], offsets[index + 1]};
}

Box3 Directory::page_box(std::uint64_t page) const {
  const Contents& pages_bytes = contents(page / kChapterPages);
  return pages_bytes.boxes[static_cast<std::size_t>(page % kChapterPages)].in(
      chapters_[static_cast<std::size_t>(page / kChapterPages)].box);
}

Box3 Directory::coarse_box(std::uint64_t page) const {
  const auto number = static_cast<std::size_t>(page / kChapterPages);
  const Contents* const loaded = contents_[number].load(std::memory_order_acquire);
  const Box3& chapter = chapters_[number].box;
  return loaded == nullptr
             ? chapter
             : loaded->boxes[static_cast<std::size_t>(page % kChapterPages)].in(chapter);
}

BytePart Directory::contents_part(std::uint64_t page) const {
  const auto number = static_cast<std::size_t>(page / kChapterPages);
  const Chapter& chapter = chapters_[number];
  const bool known = contents_[number].load(std::memory_order_acquire) != nullptr ||
                     (chapter.contents_at >= cache_offset_ && !cache_.empty());
  return {chapter.contents_at, known ? 0 : chapter.contents_bytes};
}

Bytes Directory::read_tables(const TablesPosition& at) const {
  Bytes bytes = read(at.offset, at.size + kChecksum);
  bytes.resize(checked(bytes, "the checksum of tables is wrong").size());
  return bytes;
}

}  // namespace terrace::stream::store
