// SPDX-License-Identifier: Apache-2.0
#include "io/gzip_stream.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include <fmt/core.h>
#include <zlib.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kPackedBytes = std::size_t{64} << 10;
constexpr int kGzipOnly = 16;  // added to the number of window bits

}  // namespace

struct GzipStream::Inflater {
  z_stream stream{};

  Inflater() {
    if (inflateInit2(&stream, MAX_WBITS + kGzipOnly) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
};

GzipStream::GzipStream(std::string name, std::string_view first)
    : name_(std::move(name)),
      inflater_(std::make_unique<Inflater>()),
      packed_(std::max(kPackedBytes, first.size())),
      end_(first.size()) {
  std::copy(first.begin(), first.end(), packed_.begin());
}

GzipStream::~GzipStream() = default;

Error GzipStream::fault(std::string cause) const {
  return Error(name_, std::move(cause))
      .at(fmt::format("byte {} of the gzip data", used_))
      .remedy("the file is damaged or truncated: download it again");
}

bool GzipStream::refill(const Read& read) {
  std::memmove(packed_.data(), packed_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = read(packed_.data() + end_, packed_.size() - end_);
  end_ += got;
  return got > 0;
}

std::size_t GzipStream::read(char* out, std::size_t max_bytes, const Read& read) {
  assert(max_bytes > 0);
  z_stream& stream = inflater_->stream;
  for (;;) {
    if (!in_member_) {
      if (begin_ == end_ && !refill(read)) return 0;
      inflateReset(&stream);
      in_member_ = true;
    }
    if (begin_ == end_ && !refill(read)) throw fault("the data ends within a gzip member");
    stream.next_in = reinterpret_cast<Bytef*>(packed_.data() + begin_);
    stream.avail_in = static_cast<uInt>(end_ - begin_);
    stream.next_out = reinterpret_cast<Bytef*>(out);
    const auto room =
        static_cast<uInt>(std::min<std::size_t>(max_bytes, std::numeric_limits<uInt>::max()));
    stream.avail_out = room;
    const int result = inflate(&stream, Z_NO_FLUSH);
    const std::size_t consumed = end_ - begin_ - stream.avail_in;
    begin_ += consumed;
    used_ += consumed;
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    if (result == Z_STREAM_END) {
      in_member_ = false;
    } else if (result != Z_OK && result != Z_BUF_ERROR) {
      throw fault(stream.msg != nullptr ? std::string("damaged gzip: ") + stream.msg
                                        : "damaged gzip");
    }
    if (stream.avail_out < room) return room - stream.avail_out;
  }
}

}  // namespace terrace::stream
