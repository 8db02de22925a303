// SPDX-License-Identifier: Apache-2.0
#include "format/record_parts.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <terrace/base/work_ahead.hpp>

namespace terrace::stream {
namespace {

/// Reads one part after another on the caller's thread, in pieces.
class SequentialParts final : public RecordReader {
 public:
  explicit SequentialParts(RecordParts parts)
      : parts_(std::move(parts)),
        reader_(parts_.make_reader()),
        records_(std::max<std::size_t>(1, kPieceBytes / parts_.record_bytes) *
                 parts_.record_bytes) {}

  std::string_view read(std::uint64_t max_records) override {
    if (remaining_ == 0) {
      reader_->start(number_);
      remaining_ = parts_.parts[number_].points;
    }
    const auto records = static_cast<std::size_t>(
        std::min<std::uint64_t>({max_records, remaining_, records_.size() / parts_.record_bytes}));
    const std::size_t bytes =
        reader_->read(std::span(records_).first(records * parts_.record_bytes));
    remaining_ -= bytes / parts_.record_bytes;
    if (remaining_ == 0) ++number_;
    return {reinterpret_cast<const char*>(records_.data()), bytes};
  }

  std::uint64_t held_bytes() const override {
    std::uint64_t largest = 0;
    for (const RecordPart& part : parts_.parts) largest = std::max(largest, part.bytes);
    return largest;
  }

 private:
  static constexpr std::size_t kPieceBytes = 64u << 10;

  RecordParts parts_;
  std::unique_ptr<PartReader> reader_;
  std::vector<std::byte> records_;
  std::size_t number_ = 0;       ///< of the current part
  std::uint64_t remaining_ = 0;  ///< points of it that have not been read
};

/// Reads the next parts in advance, and delivers each when it is complete.
class PartsAhead final : public RecordReader {
 public:
  /// Holds up to `slots` parts, coded and decoded, and a reader per thread. threads: 0 to read on
  /// the caller's.
  PartsAhead(RecordParts parts, unsigned threads, std::size_t slots, OnDamage on_damage)
      : parts_(std::move(parts)),
        on_damage_(std::move(on_damage)),
        slots_(slots),
        ahead_(threads, [this] { return work(); }) {}

  std::string_view read(std::uint64_t max_records) override {
    while (at_ == current_.records.size()) {
      if (number_ == parts_.parts.size()) return {};
      take_next();
    }
    const std::size_t bytes = static_cast<std::size_t>(
        std::min<std::uint64_t>(max_records,
                                (current_.records.size() - at_) / parts_.record_bytes) *
        parts_.record_bytes);
    const std::string_view records(reinterpret_cast<const char*>(current_.records.data()) + at_,
                                   bytes);
    at_ += bytes;
    return records;
  }

  std::uint64_t lost() const override { return lost_; }

 private:
  struct Part {
    std::size_t number = 0;
    std::vector<std::byte> records{};
  };

  /// Makes the next part current, unless it is damaged and may be left out, and starts reading
  /// another one.
  void take_next() {
    at_ = 0;
    // Reading starts here, not on construction, because files are also opened just for their
    // header.
    for (std::size_t free = slots_ - ahead_.size(); free > 0; --free) {
      if (next_part_ < parts_.parts.size()) {
        ahead_.give({.number = next_part_++, .records = std::exchange(current_.records, {})});
      }
    }
    current_.records.clear();
    const std::uint64_t points = parts_.parts[number_++].points;
    try {
      current_ = ahead_.take();
    } catch (const Error& damage) {
      if (!on_damage_) throw;
      lost_ += points;
      on_damage_(damage, points);
    }
  }

  base::WorkAhead<Part>::Work work() const {
    return [this, reader = std::shared_ptr<PartReader>(parts_.make_reader())](Part& part) {
      part.records.resize(parts_.parts[part.number].points * parts_.record_bytes);
      reader->start(part.number);
      for (std::size_t filled = 0; filled < part.records.size();) {
        filled += reader->read(std::span(part.records).subspan(filled));
      }
    };
  }

  const RecordParts parts_;
  const OnDamage on_damage_;
  const std::size_t slots_;
  std::uint64_t lost_ = 0;
  Part current_;               ///< the part being read
  std::size_t at_ = 0;         ///< bytes of it that were read
  std::size_t number_ = 0;     ///< of the part after it
  std::size_t next_part_ = 0;  ///< of the next part to start
  base::WorkAhead<Part> ahead_;
};

/// Numbers of readers and of parts that fit into memory together.
struct Ahead {
  std::size_t readers = 0, slots = 0;
};
Ahead ahead_within(std::uint64_t memory_bytes, const RecordParts& parts, unsigned threads) {
  constexpr std::uint64_t kReaderBytes = 4u << 20, kMaxBytes = 64u << 20;
  memory_bytes = std::min(memory_bytes, kMaxBytes);
  std::uint64_t largest = 1, max_points = 1, points = 1;
  for (const RecordPart& part : parts.parts) {
    if (part.points > kMaxBytes / parts.record_bytes) return {};
    largest = std::max(largest, part.bytes + part.points * parts.record_bytes);
    max_points = std::max(max_points, part.points);
    points += part.points;
  }
  const std::uint64_t readers = std::min<std::uint64_t>(
      {threads, memory_bytes / (largest + kReaderBytes), parts.parts.size()});
  // If all parts are equal, one slot for each reader and two for waiting parts are enough. While
  // one reader has the largest part, the others read as many points in a larger number of parts.
  const std::uint64_t slots =
      readers * std::max<std::uint64_t>(1, max_points * parts.parts.size() / points) + 2;
  return {
      static_cast<std::size_t>(readers),
      static_cast<std::size_t>(std::min(slots, (memory_bytes - readers * kReaderBytes) / largest))};
}

}  // namespace

std::unique_ptr<RecordReader> parts_ahead(const RecordParts& parts, const SourceOptions& options) {
  const Ahead ahead = ahead_within(options.memory_bytes, parts, options.threads);
  if (ahead.readers > 1) {
    return std::make_unique<PartsAhead>(parts, static_cast<unsigned>(ahead.readers), ahead.slots,
                                        options.on_damage);
  }
  // Damage may show only at the end of a part, so a part is read whole before it is delivered.
  if (ahead.readers == 0 || !options.on_damage) return nullptr;
  return std::make_unique<PartsAhead>(parts, 0, 1, options.on_damage);
}

std::unique_ptr<RecordReader> parts_in_sequence(RecordParts parts) {
  return std::make_unique<SequentialParts>(std::move(parts));
}

std::unique_ptr<RecordReader> records_of_parts(RecordParts parts, const SourceOptions& options) {
  if (auto reader = parts_ahead(parts, options)) return reader;
  return parts_in_sequence(std::move(parts));
}

}  // namespace terrace::stream
