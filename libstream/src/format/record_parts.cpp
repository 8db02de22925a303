// SPDX-License-Identifier: Apache-2.0
#include "format/record_parts.hpp"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

namespace terrace::stream {
namespace {

class PartsInTurn final : public RecordReader {
 public:
  explicit PartsInTurn(RecordParts parts)
      : parts_(std::move(parts)),
        reader_(parts_.make_reader()),
        records_(std::max<std::size_t>(1, kPieceBytes / parts_.record_bytes) *
                 parts_.record_bytes) {}

  std::string_view read(std::uint64_t wanted) override {
    if (left_ == 0) {
      reader_->start(number_);
      left_ = parts_.parts[number_].points;
    }
    const auto records = static_cast<std::size_t>(
        std::min<std::uint64_t>({wanted, left_, records_.size() / parts_.record_bytes}));
    const std::size_t bytes =
        reader_->read(std::span(records_).first(records * parts_.record_bytes));
    left_ -= bytes / parts_.record_bytes;
    if (left_ == 0) ++number_;
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
  std::size_t number_ = 0;  ///< of the current part
  std::uint64_t left_ = 0;  ///< points of it that have not been read
};

class PartsAhead final : public RecordReader {
 public:
  /// Holds up to `slots` parts, coded and decoded, and a reader per thread. threads: 0 to read on
  /// the caller's.
  PartsAhead(RecordParts parts, unsigned threads, std::size_t slots, OnDamage on_damage)
      : parts_(std::move(parts)),
        wanted_threads_(threads),
        on_damage_(std::move(on_damage)),
        slots_(slots) {}
  ~PartsAhead() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    room_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  PartsAhead(const PartsAhead&) = delete;
  PartsAhead& operator=(const PartsAhead&) = delete;

  std::string_view read(std::uint64_t wanted) override {
    if (!started_) start();
    Slot* slot = &slots_[reading_ % slots_.size()];
    if (at_ > 0 && at_ == slot->records.size()) {
      release(*slot);
      slot = &slots_[reading_ % slots_.size()];
    }
    while (at_ == 0) {
      if (reading_ == parts_.parts.size()) return {};
      wait_for(*slot);
      if (!slot->error) break;
      leave_out(*slot);
      slot = &slots_[reading_ % slots_.size()];
    }
    const std::size_t bytes = static_cast<std::size_t>(
        std::min<std::uint64_t>(wanted, (slot->records.size() - at_) / parts_.record_bytes) *
        parts_.record_bytes);
    const std::string_view found(reinterpret_cast<const char*>(slot->records.data()) + at_, bytes);
    at_ += bytes;
    return found;
  }

  std::uint64_t lost() const override { return lost_; }

 private:
  struct Slot {
    std::vector<std::byte> records;
    std::exception_ptr error;
    bool ready = false;
  };

  /// Skips a part that failed to read. Rethrows unless it is damage and a handler is set.
  void leave_out(Slot& slot) {
    try {
      std::rethrow_exception(std::exchange(slot.error, nullptr));
    } catch (const Error& damage) {
      if (!on_damage_) throw;
      const std::uint64_t points = parts_.parts[reading_].points;
      lost_ += points;
      on_damage_(damage, points);
    }
    release(slot);
  }

  /// Called only when records are requested, because files are also opened just for their header.
  void start() {
    started_ = true;
    try {
      for (unsigned i = 0; i < wanted_threads_; ++i) threads_.emplace_back([this] { run(); });
    } catch (const std::system_error&) {
      // The system has no more threads.
    }
    if (threads_.empty()) own_ = parts_.make_reader();  // the caller reads
  }

  void release(Slot& slot) {
    {
      const std::lock_guard lock(mutex_);
      slot.ready = false;
      ++reading_;
    }
    at_ = 0;
    room_.notify_all();
  }

  void wait_for(Slot& slot) {
    if (own_) {
      fill(reading_, slot, *own_);
    } else {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [&slot] { return slot.ready; });
    }
  }

  void fill(std::size_t part, Slot& slot, PartReader& reader) const {
    try {
      read_part(part, slot, reader);
    } catch (...) {
      slot.error = std::current_exception();
    }
  }

  void run() {
    std::unique_ptr<PartReader> reader;
    for (;;) {
      std::size_t part = 0;
      {
        std::unique_lock lock(mutex_);
        room_.wait(lock, [this] {
          return stop_ || (next_ < parts_.parts.size() && next_ < reading_ + slots_.size());
        });
        if (stop_) return;
        part = next_++;
      }
      Slot& slot = slots_[part % slots_.size()];
      try {
        if (!reader) reader = parts_.make_reader();
        fill(part, slot, *reader);
      } catch (...) {
        slot.error = std::current_exception();
      }
      {
        const std::lock_guard lock(mutex_);
        slot.ready = true;
      }
      news_.notify_one();
    }
  }

  void read_part(std::size_t number, Slot& slot, PartReader& reader) const {
    slot.records.resize(parts_.parts[number].points * parts_.record_bytes);
    reader.start(number);
    for (std::size_t done = 0; done < slot.records.size();) {
      done += reader.read(std::span(slot.records).subspan(done));
    }
  }

  RecordParts parts_;
  unsigned wanted_threads_;
  OnDamage on_damage_;
  std::uint64_t lost_ = 0;
  bool started_ = false;
  std::vector<Slot> slots_;
  std::unique_ptr<PartReader> own_;  ///< without threads
  std::size_t at_ = 0;               ///< bytes of the part being read

  std::mutex mutex_;
  std::condition_variable news_, room_;
  std::size_t reading_ = 0, next_ = 0;  ///< parts
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

/// How many readers, and how many parts at once, fit into memory.
struct Ahead {
  std::size_t readers = 0, slots = 0;
};
Ahead ahead_within(std::uint64_t memory_bytes, const RecordParts& parts, unsigned threads) {
  constexpr std::uint64_t kReaderBytes = 4u << 20, kMostBytes = 64u << 20;
  memory_bytes = std::min(memory_bytes, kMostBytes);
  std::uint64_t largest = 1, most_points = 1, points = 1;
  for (const RecordPart& part : parts.parts) {
    if (part.points > kMostBytes / parts.record_bytes) return {};
    largest = std::max(largest, part.bytes + part.points * parts.record_bytes);
    most_points = std::max(most_points, part.points);
    points += part.points;
  }
  const std::uint64_t readers = std::min<std::uint64_t>(
      {threads, memory_bytes / (largest + kReaderBytes), parts.parts.size()});
  // If all parts are equal, one slot for each reader and two for waiting parts are enough. While
  // one reader has the largest part, the others read as many points in a larger number of parts.
  const std::uint64_t wanted =
      readers * std::max<std::uint64_t>(1, most_points * parts.parts.size() / points) + 2;
  return {static_cast<std::size_t>(readers),
          static_cast<std::size_t>(
              std::min(wanted, (memory_bytes - readers * kReaderBytes) / largest))};
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

std::unique_ptr<RecordReader> parts_in_turn(RecordParts parts) {
  return std::make_unique<PartsInTurn>(std::move(parts));
}

std::unique_ptr<RecordReader> records_of_parts(RecordParts parts, const SourceOptions& options) {
  if (auto reader = parts_ahead(parts, options)) return reader;
  return parts_in_turn(std::move(parts));
}

}  // namespace terrace::stream
