// SPDX-License-Identifier: Apache-2.0
#include "format/las/laz_chunks.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Chunks decoded piece by piece: however many points one has, its records need not be held at
/// once.
class LazOneByOne final : public RecordReader {
 public:
  LazOneByOne(std::unique_ptr<ByteSource> file, LazLayout layout)
      : file_(std::move(file)),
        layout_(std::move(layout)),
        record_bytes_(layout_.vlr.record_length()),
        decoder_(layout_.vlr),
        records_(std::max<std::size_t>(1, kPieceBytes / record_bytes_) * record_bytes_) {}

  std::string_view read(std::uint64_t wanted) override {
    const laz::Chunk& chunk = layout_.chunks[number_];
    const std::uint64_t begin = layout_.first + chunk.offset;
    if (left_ == 0) {
      coded_.resize(chunk.bytes);
      file_->read(begin, coded_);
      decoder_.start(chunk.points);
      left_ = chunk.points;
      used_ = 0;
    }
    const auto records = static_cast<std::size_t>(
        std::min<std::uint64_t>({wanted, left_, records_.size() / record_bytes_}));
    laz::Decoder::Step step;
    try {
      step = decoder_.step(std::span(coded_).subspan(used_), true,
                           std::span(records_).first(records * record_bytes_));
      used_ += step.bytes;
      left_ -= step.points;
      if (step.points == 0) throw laz::Corrupt("the chunk ends before its points", used_);
      if (left_ == 0 && used_ != coded_.size()) {
        throw laz::Corrupt("coded bytes are left over", used_);
      }
    } catch (const laz::Corrupt& error) {
      fail_chunk(file_->name(), number_, begin + error.offset(), error.what());
    }
    if (left_ == 0) ++number_;
    return {reinterpret_cast<const char*>(records_.data()), step.points * record_bytes_};
  }

  std::uint64_t held_bytes() const override {
    std::uint64_t largest = 0;
    for (const laz::Chunk& chunk : layout_.chunks) largest = std::max(largest, chunk.bytes);
    return largest;
  }

 private:
  static constexpr std::size_t kPieceBytes = 64u << 10;

  std::unique_ptr<ByteSource> file_;
  LazLayout layout_;
  std::size_t record_bytes_;
  laz::Decoder decoder_;
  std::vector<std::byte> coded_, records_;
  std::size_t number_ = 0, used_ = 0;  ///< the chunk and its bytes that are decoded
  std::uint64_t left_ = 0;             ///< points of it
};

/// Chunks decoded by several threads, a few ahead of the one that is being read.
class LazAhead final : public RecordReader {
 public:
  /// Takes `slots` times a chunk's bytes and records, and a decoder's models per thread.
  LazAhead(std::unique_ptr<ByteSource> file, LazLayout layout, unsigned threads, std::size_t slots)
      : file_(std::move(file)),
        layout_(std::move(layout)),
        record_bytes_(layout_.vlr.record_length()),
        wanted_threads_(threads),
        slots_(slots) {}
  ~LazAhead() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    room_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  LazAhead(const LazAhead&) = delete;
  LazAhead& operator=(const LazAhead&) = delete;

  std::string_view read(std::uint64_t wanted) override {
    if (!started_) start();
    Slot* slot = &slots_[reading_ % slots_.size()];
    if (at_ == slot->records.size() && at_ > 0) {
      release(*slot);
      slot = &slots_[reading_ % slots_.size()];
    }
    if (at_ == 0) wait_for(*slot);
    const std::size_t bytes = static_cast<std::size_t>(
        std::min<std::uint64_t>(wanted, (slot->records.size() - at_) / record_bytes_) *
        record_bytes_);
    const std::string_view found(reinterpret_cast<const char*>(slot->records.data()) + at_, bytes);
    at_ += bytes;
    return found;
  }

 private:
  struct Slot {
    std::vector<std::byte> coded, records;
    std::exception_ptr error;
    bool ready = false;
  };

  /// Only when records are asked for: files are opened to be looked at, too.
  void start() {
    started_ = true;
    try {
      for (unsigned i = 0; i < wanted_threads_; ++i) threads_.emplace_back([this] { run(); });
    } catch (const std::system_error&) {
      // The system grants no more threads; without any the caller decodes.
      if (threads_.empty()) own_.emplace(layout_.vlr);
    }
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
      decode(reading_, slot, *own_);
    } else {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [&slot] { return slot.ready; });
    }
    if (slot.error) std::rethrow_exception(slot.error);
  }

  void run() {
    std::optional<laz::Decoder> decoder;
    for (;;) {
      std::size_t chunk = 0;
      {
        std::unique_lock lock(mutex_);
        room_.wait(lock, [this] {
          return stop_ || (next_ < layout_.chunks.size() && next_ < reading_ + slots_.size());
        });
        if (stop_) return;
        chunk = next_++;
      }
      Slot& slot = slots_[chunk % slots_.size()];
      try {
        if (!decoder) decoder.emplace(layout_.vlr);
        decode(chunk, slot, *decoder);
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

  void decode(std::size_t number, Slot& slot, laz::Decoder& decoder) const {
    const laz::Chunk& chunk = layout_.chunks[number];
    slot.coded.resize(chunk.bytes);
    slot.records.resize(chunk.points * record_bytes_);
    file_->read(layout_.first + chunk.offset, slot.coded);
    try {
      decoder.decode_chunk(slot.coded, slot.records);
    } catch (const laz::Corrupt& error) {
      fail_chunk(file_->name(), number, layout_.first + chunk.offset + error.offset(),
                 error.what());
    }
  }

  std::unique_ptr<ByteSource> file_;
  LazLayout layout_;
  std::size_t record_bytes_;
  unsigned wanted_threads_;
  bool started_ = false;
  std::vector<Slot> slots_;
  std::optional<laz::Decoder> own_;
  std::size_t at_ = 0;  ///< bytes of the chunk being read

  std::mutex mutex_;
  std::condition_variable news_, room_;
  std::size_t reading_ = 0, next_ = 0;  ///< chunks
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

/// How many chunks may be in memory at once.
std::size_t slots_within(std::uint64_t memory_bytes, const LazLayout& layout, unsigned threads) {
  constexpr std::uint64_t kDecoderBytes = 4u << 20, kMostBytes = 64u << 20;
  memory_bytes = std::min(memory_bytes, kMostBytes);
  std::uint64_t largest = 1;
  for (const laz::Chunk& chunk : layout.chunks) {
    largest = std::max(largest, chunk.bytes + chunk.points * layout.vlr.record_length());
  }
  const std::uint64_t room = memory_bytes / (largest + kDecoderBytes);
  return static_cast<std::size_t>(std::min<std::uint64_t>(room, threads + 2));
}

}  // namespace

void fail_laz(const std::string& file, std::string where, std::string cause) {
  throw Error({.file = file,
               .where = std::move(where),
               .cause = std::move(cause),
               .remedy = "the file is damaged: get it anew"});
}
void fail_chunk(const std::string& file, std::uint64_t chunk, std::uint64_t byte,
                const std::string& cause) {
  fail_laz(file, "chunk " + std::to_string(chunk) + ", byte " + std::to_string(byte), cause);
}

std::unique_ptr<RecordReader> chunks_ahead(std::unique_ptr<ByteSource>& file, LazLayout& layout,
                                           const SourceOptions& options) {
  const std::size_t slots = slots_within(options.memory_bytes, layout, options.threads);
  if (options.threads <= 1 || slots <= 1 || layout.chunks.size() <= 1) return nullptr;
  const auto threads =
      static_cast<unsigned>(std::min<std::size_t>({options.threads, slots, layout.chunks.size()}));
  return std::make_unique<LazAhead>(std::move(file), std::move(layout), threads, slots);
}

std::unique_ptr<RecordReader> chunks_one_by_one(std::unique_ptr<ByteSource> file,
                                                LazLayout layout) {
  return std::make_unique<LazOneByOne>(std::move(file), std::move(layout));
}

}  // namespace terrace::stream
