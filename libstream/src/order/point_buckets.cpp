// SPDX-License-Identifier: Apache-2.0
#include "order/point_buckets.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>

#include "terrace/stream/error.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

/// Copies a few bytes by words. Inlined, unlike memcpy() with a variable size.
inline void copy_short(const std::byte* source, std::byte* target, std::size_t bytes) {
  using Word = std::uint64_t;
  if (bytes < sizeof(Word)) {
    for (std::size_t i = 0; i < bytes; ++i) target[i] = source[i];
    return;
  }
  const auto copy_at = [&](std::size_t at) {
    Word word;
    std::memcpy(&word, source + at, sizeof word);
    std::memcpy(target + at, &word, sizeof word);
  };
  for (std::size_t at = 0; at + sizeof(Word) < bytes; at += sizeof(Word)) copy_at(at);
  copy_at(bytes - sizeof(Word));
}

}  // namespace

PackedPoints::PackedPoints(const Schema& schema) {
  std::size_t bytes = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    types_[axis] = schema.coordinates[axis].type;
    offsets_[axis] = bytes;
    bytes += size_of(types_[axis]);
    integers_ = integers_ && with_type(types_[axis], [](auto type) {
                  return std::is_integral_v<decltype(type)> &&
                         (sizeof type < 4 || std::is_same_v<decltype(type), std::int32_t>);
                });
  }
  payload_offset_ = bytes;
  record_bytes_ = bytes + schema.payload_size();
}

template <class Write>
void PackedPoints::with_packing(const PointBlock& block, const Write& write) const {
  const std::size_t payload = payload_bytes();
  const auto with_coordinates = [&](const auto& pack_coordinates) {
    write([&](std::size_t i, std::byte* target) {
      pack_coordinates(block.positions[i], target);
      copy_short(block.payload.data() + i * payload, target + payload_offset_, payload);
    });
  };
  const auto pack_coordinate = [](double coordinate, std::byte* target, auto type) {
    type = static_cast<decltype(type)>(coordinate);
    assert(static_cast<double>(type) == coordinate);
    std::memcpy(target, &type, sizeof type);
  };
  if (types_[0] == types_[1] && types_[1] == types_[2]) {
    with_type(types_[0], [&](auto type) {
      with_coordinates([&](const Point3& p, std::byte* target) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          pack_coordinate(p[axis], target + axis * sizeof type, type);
        }
      });
    });
  } else {
    with_coordinates([&](const Point3& p, std::byte* target) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        with_type(types_[axis],
                  [&](auto type) { pack_coordinate(p[axis], target + offsets_[axis], type); });
      }
    });
  }
}

template <class Coordinate, class Read>
void PackedPoints::with_unpacking(const Read& read) const {
  const auto unpack_coordinate = [](const std::byte* source, auto type) {
    std::memcpy(&type, source, sizeof type);
    return static_cast<Coordinate>(type);
  };
  if (types_[0] == types_[1] && types_[1] == types_[2]) {
    with_type(types_[0], [&](auto type) {
      read([&](const std::byte* source) {
        return std::array{unpack_coordinate(source, type),
                          unpack_coordinate(source + sizeof type, type),
                          unpack_coordinate(source + 2 * sizeof type, type)};
      });
    });
  } else {
    read([&](const std::byte* source) {
      std::array<Coordinate, 3> place;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        place[axis] = with_type(types_[axis], [&](auto type) {
          return unpack_coordinate(source + offsets_[axis], type);
        });
      }
      return place;
    });
  }
}

void PackedPoints::pack(const PointBlock& block, std::vector<std::byte>& records) const {
  records.resize(block.size() * record_bytes_);
  with_packing(block, [&](const auto& pack) {
    std::byte* target = records.data();
    for (std::size_t i = 0; i < block.size(); ++i, target += record_bytes_) pack(i, target);
  });
}

template <class Coordinate>
void PackedPoints::unpack(std::span<const std::byte> records,
                          std::vector<Numbered<Coordinate>>& points) const {
  points.resize(records.size() / record_bytes_);
  with_unpacking<Coordinate>([&](const auto& unpack) {
    const std::byte* source = records.data();
    std::uint32_t number = 0;
    for (Numbered<Coordinate>& point : points) {
      point.place = unpack(source);
      point.number = number++;
      source += record_bytes_;
    }
  });
}
template void PackedPoints::unpack(std::span<const std::byte>, std::vector<NumberedPoint>&) const;
template void PackedPoints::unpack(std::span<const std::byte>,
                                   std::vector<NumberedIntegers>&) const;

/// How many records ahead of the one being unpacked are prefetched.
constexpr std::size_t kRecordsAhead = 24;

void PackedPoints::unpack(std::span<const std::byte> records,
                          std::span<const std::uint32_t> numbers, PointBlock& block) const {
  const std::size_t payload = payload_bytes();
  block.positions.resize(numbers.size());
  block.payload.resize(numbers.size() * payload);
  with_unpacking<double>([&](const auto& unpack) {
    std::byte* target = block.payload.data();
    for (std::size_t i = 0; i < numbers.size(); ++i, target += payload) {
      const std::size_t ahead = numbers[std::min(i + kRecordsAhead, numbers.size() - 1)];
      __builtin_prefetch(records.data() + ahead * record_bytes_);
      __builtin_prefetch(records.data() + (ahead + 1) * record_bytes_ - 1);
      const std::byte* const source = records.data() + numbers[i] * record_bytes_;
      block.positions[i] = unpack(source);
      copy_short(source + payload_offset_, target, payload);
    }
  });
}

template <class Put>
void PackedPoints::sort_by(std::span<const std::uint16_t> keys, std::size_t keys_end,
                           std::vector<std::byte>& sorted, std::vector<std::size_t>& begins,
                           const Put& put) const {
  begins.assign(keys_end + 1, 0);
  for (const std::uint16_t key : keys) ++begins[key + 1U];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<std::size_t> next(begins.begin(), begins.end() - 1);
  sorted.resize(keys.size() * record_bytes_);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    put(i, sorted.data() + next[keys[i]]++ * record_bytes_);
  }
}

void PackedPoints::sort(std::span<const std::byte> records, std::span<const std::uint16_t> keys,
                        std::size_t keys_end, std::vector<std::byte>& sorted,
                        std::vector<std::size_t>& begins) const {
  sort_by(keys, keys_end, sorted, begins, [&](std::size_t i, std::byte* target) {
    copy_short(records.data() + i * record_bytes_, target, record_bytes_);
  });
}

void PackedPoints::sort(const PointBlock& block, std::span<const std::uint16_t> keys,
                        std::size_t keys_end, std::vector<std::byte>& sorted,
                        std::vector<std::size_t>& begins) const {
  with_packing(block, [&](const auto& pack) { sort_by(keys, keys_end, sorted, begins, pack); });
}

void Bucket::append(Bucket&& next) {
  chunks.insert(chunks.end(), next.chunks.begin(), next.chunks.end());
  tail.insert(tail.end(), next.tail.begin(), next.tail.end());
  next = {};
}

BucketFile::BucketFile(const std::string& name, const std::filesystem::path& folder,
                       std::size_t record_bytes)
    : record_bytes_(record_bytes),
      chunk_bytes_(std::max<std::size_t>(kBucketBytes / record_bytes, 1) * record_bytes),
      file_(name, folder),
      packer_(record_bytes) {}

void BucketFile::append(Bucket& bucket, std::span<const std::byte> records, RecordPacker& packer) {
  if (bucket.tail.capacity() < chunk_bytes_) bucket.tail.reserve(chunk_bytes_);
  while (!records.empty()) {
    assert(bucket.tail.size() < chunk_bytes_);
    const std::size_t bytes = std::min(chunk_bytes_ - bucket.tail.size(), records.size());
    const auto part = records.first(bytes);
    bucket.tail.insert(bucket.tail.end(), part.begin(), part.end());
    records = records.subspan(bytes);
    if (bucket.tail.size() >= chunk_bytes_) write(bucket, packer);
  }
}

/// Moves the bucket's records in memory to the file.
void BucketFile::write(Bucket& bucket, RecordPacker& packer) {
  std::span<const std::byte> bytes = packer.pack(bucket.tail);
  if (bytes.size() >= chunk_bytes_) bytes = bucket.tail;
  std::vector<std::byte> full;
  std::unique_lock lock(mutex_);
  const std::uint64_t end = pages_;
  const Bucket::Chunk chunk = allocate(bytes.size());
  std::uint64_t page = chunk.page;
  if (page == end) {
    unwritten_.insert(unwritten_.end(), bytes.begin(), bytes.end());
    unwritten_.resize((pages_ - unwritten_page_) * kPageBytes);
    bytes = {};
    if (unwritten_.size() >= kMinWriteBytes) {
      full.swap(free_buffer_);
      full.swap(unwritten_);
      page = std::exchange(unwritten_page_, pages_);
      bytes = full;
    }
  }
  lock.unlock();
  if (!bytes.empty()) file_.write(page * kPageBytes, bytes);
  if (!full.empty()) {
    full.clear();
    lock.lock();
    free_buffer_.swap(full);
  }
  bucket.chunks.push_back(chunk);
  bucket.tail.clear();
}

/// Returns the smallest free position that is large enough, or one at the end of the file.
Bucket::Chunk BucketFile::allocate(std::size_t bytes) {
  const auto pages = static_cast<std::uint32_t>((bytes + kPageBytes - 1) / kPageBytes);
  Bucket::Chunk chunk{.page = pages_, .pages = pages, .bytes = static_cast<std::uint32_t>(bytes)};
  const auto found = free_.lower_bound(pages);
  if (found == free_.end()) {
    if (pages > UINT32_MAX - pages_) {
      throw Error(file_.name(), "its points need more than 4 TiB of temporary disk space")
          .remedy("split the input");
    }
    pages_ += pages;
    return chunk;
  }
  chunk.pages = found->first;
  chunk.page = found->second.back();
  found->second.pop_back();
  if (found->second.empty()) free_.erase(found);
  return chunk;
}

void BucketFile::read(const Bucket::Chunk& chunk, std::span<std::byte> records) {
  if (chunk.page >= unwritten_page_) {
    file_.write(unwritten_page_ * kPageBytes, unwritten_);
    unwritten_page_ = pages_;
    unwritten_.clear();
  }
  const bool packed = chunk.bytes < chunk_bytes_;
  packed_.resize(packed ? chunk.bytes : 0);
  file_.read(chunk.page * kPageBytes, packed ? std::span(packed_) : records);
  if (packed) packer_.unpack(packed_, records);
}

std::uint64_t BucketFile::records(const Bucket& bucket) const {
  return (bucket.chunks.size() * chunk_bytes_ + bucket.tail.size()) / record_bytes_;
}

void BucketFile::take(Bucket& bucket, std::uint64_t max_records, std::vector<std::byte>& out) {
  const std::uint64_t max_chunks =
      std::max<std::uint64_t>(max_records * record_bytes_ / chunk_bytes_, 1);
  const std::size_t chunks = std::min<std::uint64_t>(bucket.chunks.size(), max_chunks);
  // Reserves the maximum, because `out` is reused.
  out.reserve(max_chunks * chunk_bytes_ + bucket.tail.size());
  out.resize(chunks * chunk_bytes_);
  for (std::size_t i = 0; i < chunks; ++i) {
    const Bucket::Chunk& chunk = bucket.chunks[i];
    read(chunk, std::span(out).subspan(i * chunk_bytes_, chunk_bytes_));
    free_[chunk.pages].push_back(chunk.page);
  }
  bucket.chunks.erase(bucket.chunks.begin(),
                      bucket.chunks.begin() + static_cast<std::ptrdiff_t>(chunks));
  if (bucket.chunks.empty() && (out.size() + bucket.tail.size()) / record_bytes_ <= max_records) {
    out.insert(out.end(), bucket.tail.begin(), bucket.tail.end());
    bucket.tail = {};
  }
}

void BucketFile::sample(const Bucket& bucket, std::uint64_t max_records,
                        std::vector<std::byte>& out) {
  const std::uint64_t max_chunks =
      std::max<std::uint64_t>(max_records * record_bytes_ / chunk_bytes_, 1);
  const std::size_t count = std::min<std::uint64_t>(bucket.chunks.size(), max_chunks);
  out.resize(count * chunk_bytes_);
  for (std::size_t i = 0; i < count; ++i) {
    read(bucket.chunks[i * bucket.chunks.size() / count],
         std::span(out).subspan(i * chunk_bytes_, chunk_bytes_));
  }
}

}  // namespace terrace::stream
