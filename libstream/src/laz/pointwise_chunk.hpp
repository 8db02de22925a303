// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "laz/layout.hpp"
#include "laz/models.hpp"
#include "laz/pointwise.hpp"
#include "laz/pointwise_v1.hpp"

namespace terrace::stream::laz {

/// Models and state of pointwise chunks in either direction and version.
template <class Coder>
class Pointwise {
 public:
  using Record = typename Coder::Record;

  explicit Pointwise(const RecordLayout& layout) : layout_(layout), last_(layout.length) {
    if (layout.version == 1) {
      v1_ = make_zeroed<PointwiseV1>(1);
      extra_v1_ = make_zeroed<SymbolModel<9>>(layout.extra_bytes);
    } else {
      v2_ = make_zeroed<PointwiseV2>(1);
      extra_v2_ = make_zeroed<SymbolModel<256>>(layout.extra_bytes);
    }
  }

  Coder coder;

  /// Maximum coded bytes per record.
  [[nodiscard]] std::size_t max_bytes() const { return 512 + 4 * layout_.extra_bytes; }

  /// Begins a chunk with its first record. The caller must begin the coder.
  void begin(const std::uint8_t* first) {
    std::memcpy(last_.data(), first, last_.size());
    if (v1_ != nullptr) v1_[0].begin(layout_, first);
    if (v2_ != nullptr) v2_[0].begin(layout_, first);
  }

  /// Codes the next `count` records; if `open`, only as long as max_bytes() bytes are left to
  /// decode. Returns the number coded.
  std::size_t code(Record records, std::size_t count, bool open) {
    return v2_ != nullptr ? code(v2_[0], extra_v2_.get(), records, count, open)
                          : code(v1_[0], extra_v1_.get(), records, count, open);
  }

 private:
  template <class Models, class Extra>
  std::size_t code(Models& models, Extra* extra, Record records, std::size_t count, bool open) {
    const RecordLayout layout = layout_;
    Coder local = coder;
    const std::uint8_t* last = last_.data();
    std::size_t coded = 0;
    for (; coded < count; ++coded) {
      if constexpr (Coder::kDecoding) {
        if (open && !local.has(max_bytes())) break;
      }
      models.code(local, layout, extra, last, records);
      last = records;
      records += layout.length;
    }
    // The caller's records may not exist until the next call.
    if (coded > 0) std::memcpy(last_.data(), last, last_.size());
    coder = local;
    return coded;
  }

  RecordLayout layout_;
  Zeroed<PointwiseV1> v1_;
  Zeroed<SymbolModel<9>> extra_v1_;
  Zeroed<PointwiseV2> v2_;
  Zeroed<SymbolModel<256>> extra_v2_;
  std::vector<std::uint8_t> last_;  ///< the last coded record
};

}  // namespace terrace::stream::laz
