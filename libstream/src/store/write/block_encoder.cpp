// SPDX-License-Identifier: Apache-2.0
#include "store/write/block_encoder.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "store/codec/column_codec.hpp"
#include "store/codec/form.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

/// A block's extent in steps of its boxes, in bits: boxes of clusters are grown to multiples of
/// 1/2048 of the block, which costs a point a thousandth of a bit and saves the index half.
constexpr unsigned kBoxBits = 11;

/// The greatest number of low bits that a form's largest values leave all set (see record_of: a
/// grown box must still be finite).
unsigned most_shift(NumberForm form) {
  if (form == kFloatBits) return 23;
  return form == kDoubleBits ? 52 : 40;
}

bool is_floating(ScalarType type) { return type == ScalarType::f32 || type == ScalarType::f64; }

/// One coordinate of the points as integers, in one pass without branches: what nearly every raster
/// takes. False if there are others.
bool load_integers(std::span<const Point3> positions, std::size_t axis,
                   std::vector<std::int64_t>& out) {
  out.resize(positions.size());
  std::uint64_t difference = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double value = positions[i][axis];
    const auto k = static_cast<std::int64_t>(std::abs(value) < 0x1p53 ? value : 0.5);
    difference |=
        std::bit_cast<std::uint64_t>(static_cast<double>(k)) ^ std::bit_cast<std::uint64_t>(value);
    out[i] = k;
  }
  return difference == 0;
}

bool is_integer(double value) {
  return std::abs(value) < 0x1p53 &&
         std::bit_cast<std::uint64_t>(static_cast<double>(static_cast<std::int64_t>(value))) ==
             std::bit_cast<std::uint64_t>(value);
}

template <class T>
void gather(std::span<const std::byte> payload, std::size_t stride, std::size_t offset,
            std::vector<std::int64_t>& out) {
  const std::size_t n = stride == 0 ? 0 : payload.size() / stride;
  out.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    T value;
    std::memcpy(&value, payload.data() + i * stride + offset, sizeof value);
    // The sign of int8 is meant.
    out[i] = static_cast<std::int64_t>(value);  // NOLINT(bugprone-signed-char-misuse)
  }
}

void gather(ScalarType type, std::span<const std::byte> payload, std::size_t stride,
            std::size_t offset, std::vector<std::int64_t>& out) {
  switch (type) {
    case ScalarType::i8:
      return gather<std::int8_t>(payload, stride, offset, out);
    case ScalarType::u8:
      return gather<std::uint8_t>(payload, stride, offset, out);
    case ScalarType::i16:
      return gather<std::int16_t>(payload, stride, offset, out);
    case ScalarType::u16:
      return gather<std::uint16_t>(payload, stride, offset, out);
    case ScalarType::i32:
    case ScalarType::f32:
      return gather<std::int32_t>(payload, stride, offset, out);
    case ScalarType::u32:
      return gather<std::uint32_t>(payload, stride, offset, out);
    case ScalarType::i64:
    case ScalarType::f64:
      return gather<std::int64_t>(payload, stride, offset, out);
    case ScalarType::u64:
      return gather<std::uint64_t>(payload, stride, offset, out);
  }
}

}  // namespace

void BlockEncoder::load(const Layout& layout, const ClusteredBlock& block) {
  layout_ = &layout;
  block_ = &block;
  for (std::size_t axis = 0; axis < 3; ++axis) load_axis(axis);
  load_attributes();
}

void BlockEncoder::load_axis(std::size_t axis) {
  const std::size_t n = block_->positions.size();
  std::vector<std::int64_t>& out = axes_[axis];
  forms_[axis] = kIntegerForm;
  const auto box_is_integer = [&](const ClusterSummary& summary) {
    return summary.box.empty() ||
           (is_integer(summary.box.min[axis]) && is_integer(summary.box.max[axis]));
  };
  if (!load_integers(block_->positions, axis, out) ||
      !std::all_of(block_->summaries.begin(), block_->summaries.end(), box_is_integer)) {
    doubles_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      doubles_[i] = block_->positions[i][axis];
      if (!std::isfinite(doubles_[i])) {
        throw Error({.file = {},
                     .where = {},
                     .cause = "a point has a coordinate that is not finite",
                     .remedy = "leave such points out"});
      }
    }
    for (const ClusterSummary& summary : block_->summaries) {
      if (summary.box.empty()) continue;
      doubles_.push_back(summary.box.min[axis]);
      doubles_.push_back(summary.box.max[axis]);
    }
    forms_[axis] = form_of(doubles_);
    out.resize(n);
    for (std::size_t i = 0; i < n; ++i) out[i] = to_integer(doubles_[i], forms_[axis]);
  }
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  for (const std::int64_t value : out) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  for (const ClusterSummary& summary : block_->summaries) {
    if (summary.box.empty()) continue;
    low = std::min(low, to_integer(summary.box.min[axis], forms_[axis]));
    high = std::max(high, to_integer(summary.box.max[axis], forms_[axis]));
  }
  const auto extent =
      low > high ? 0 : static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low);
  const auto bits = static_cast<unsigned>(std::bit_width(extent));
  shifts_[axis] = std::min(bits > kBoxBits ? bits - kBoxBits : 0, most_shift(forms_[axis]));
}

void BlockEncoder::load_attributes() {
  const std::size_t count = layout_->attributes.size();
  attributes_.resize(count);
  attribute_forms_.assign(count, kIntegerForm);
  std::size_t offset = 0;
  for (std::size_t a = 0; a < count; ++a) {
    const ScalarType type = layout_->attributes[a];
    std::vector<std::int64_t>& values = attributes_[a];
    gather(type, block_->payload, layout_->payload_size, offset, values);
    offset += size_of(type);
    if (!is_floating(type)) continue;

    const bool single = type == ScalarType::f32;
    doubles_.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      doubles_[i] = single ? std::bit_cast<float>(static_cast<std::int32_t>(values[i]))
                           : std::bit_cast<double>(values[i]);
    }
    NumberForm form = form_of(doubles_);
    if (form == kDoubleBits && single) form = kFloatBits;
    attribute_forms_[a] = form;
    for (std::size_t i = 0; i < values.size(); ++i) {
      // From the bits where the form is bits: arithmetic would not keep a signalling NaN.
      if (form == kFloatBits && single) {
        const auto bits = static_cast<std::int32_t>(values[i]);
        values[i] = bits < 0 ? bits ^ INT32_MAX : bits;
      } else if (form == kDoubleBits) {
        values[i] = values[i] < 0 ? values[i] ^ INT64_MAX : values[i];
      } else {
        values[i] = to_integer(doubles_[i], form);
      }
    }
  }
}

Entry BlockEncoder::enter(std::size_t cluster) {
  const std::uint32_t first = block_->first[cluster], last = block_->first[cluster + 1];
  members_ = block_->order.subspan(first, last - first);
  const auto n = static_cast<std::uint32_t>(members_.size());
  if (n > layout_->most_points()) {
    throw Error({.file = {},
                 .where = {},
                 .cause = "a cluster has " + std::to_string(n) + " points, of this size a store " +
                          "has at most " + std::to_string(layout_->most_points()) + " in one",
                 .remedy = "make the blocks smaller"});
  }
  representative_ = UINT32_MAX;
  const std::uint32_t representative = block_->representatives[cluster];
  if (representative != UINT32_MAX) {
    const auto at = std::find(members_.begin(), members_.end(), representative);
    assert(at != members_.end() && "a representative is a point of its cluster");
    representative_ = static_cast<std::uint32_t>(at - members_.begin());
  }

  Entry entry;
  entry.points = n;
  entry.forms = forms_;
  own_box_ = false;
  if (n == 0) return entry;
  const ClusterSummary* summary =
      cluster < block_->summaries.size() ? &block_->summaries[cluster] : nullptr;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<std::int64_t>& values = axes_[axis];
    std::int64_t low = INT64_MAX, high = INT64_MIN;
    for (const std::uint32_t member : members_) {
      low = std::min(low, values[member]);
      high = std::max(high, values[member]);
    }
    std::int64_t outer_low = low, outer_high = high;
    if (summary != nullptr && !summary->box.empty()) {
      outer_low = std::min(low, to_integer(summary->box.min[axis], forms_[axis]));
      outer_high = std::max(high, to_integer(summary->box.max[axis], forms_[axis]));
    }
    const std::uint64_t step = (std::uint64_t{1} << shifts_[axis]) - 1;
    outer_low = static_cast<std::int64_t>(static_cast<std::uint64_t>(outer_low) & ~step);
    outer_high = static_cast<std::int64_t>(static_cast<std::uint64_t>(outer_high) | step);

    const auto unsigned_of = [](std::int64_t v) { return static_cast<std::uint64_t>(v); };
    entry.low[axis] = outer_low;
    entry.size[axis] = unsigned_of(outer_high) - unsigned_of(outer_low) + 1;
    entry_box_.low[axis] = 0;
    entry_box_.size[axis] = entry.size[axis];
    coded_box_.low[axis] = unsigned_of(low) - unsigned_of(outer_low);
    coded_box_.size[axis] = unsigned_of(high) - unsigned_of(low) + 1;
    const std::uint64_t spare = entry.size[axis] - coded_box_.size[axis];
    own_box_ |= spare > 2 * step && spare > coded_box_.size[axis] / 16;
  }
  if (!own_box_) coded_box_ = entry_box_;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t origin = static_cast<std::uint64_t>(entry.low[axis]) + coded_box_.low[axis];
    relative_[axis].resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      relative_[axis][i] = static_cast<std::uint64_t>(axes_[axis][members_[i]]) - origin;
    }
  }
  if (summary != nullptr) {
    if (!(summary->error >= 0)) {
      throw Error({.file = {},
                   .where = {},
                   .cause = "a cluster's error is not a number from 0 up",
                   .remedy = {}});
    }
    entry.error = error_code(std::abs(summary->error));
    entry.descendants = layout_->level == 0 ? 0 : summary->descendants;
  }
  return entry;
}

/// Of the present cluster's points.
KeyRange BlockEncoder::range_of(std::size_t attribute) const {
  if (members_.empty()) return {0, UINT64_MAX};
  const std::vector<std::int64_t>& values = attributes_[attribute];
  const ScalarType type = layout_->attributes[attribute];
  if (type == ScalarType::u64) {
    KeyRange range;
    for (const std::uint32_t member : members_) {
      const auto value = static_cast<std::uint64_t>(values[member]);
      range = {std::min(range.low, value), std::max(range.high, value)};
    }
    return range;
  }
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  for (const std::uint32_t member : members_) {
    low = std::min(low, values[member]);
    high = std::max(high, values[member]);
  }
  if (!is_floating(type)) return {attribute_key(low), attribute_key(high)};
  // Number forms keep the order, and NaN at its ends.
  const NumberForm form = attribute_forms_[attribute];
  return {attribute_key(to_double(low, form)), attribute_key(to_double(high, form))};
}

/// Codes the head and the places of the points; on a grid hands over to `heights`. Sets order_.
template <class Use>
void BlockEncoder::positions(SymbolEncoder& coder, const Columns& columns, Use&& heights) {
  const auto n = static_cast<std::uint32_t>(members_.size());
  const auto& size = coded_box_.size;
  bool grid = layout_->grid && layout_->level == 0 && GridCodec::fits(size[0], size[1], n);
  grid =
      grid && grid_.place(static_cast<std::uint32_t>(size[0]), static_cast<std::uint32_t>(size[1]),
                          relative_[0].data(), relative_[1].data(), relative_[2].data(), n);
  const bool sequence = columns.sequence && n > 1;
  coder.symbol(context::kForm, (grid || sequence ? 0 : kSplitForm) | (own_box_ ? kOwnBoxForm : 0));
  if (own_box_) code_box(coder, entry_box_, coded_box_);
  order_.resize(n);
  scratch_.resize(n);
  if (grid) {
    grid_.positions(coder, static_cast<std::uint32_t>(size[0]), static_cast<std::uint32_t>(size[1]),
                    n, nullptr, nullptr);
    heights();
    for (std::uint32_t i = 0; i < n; ++i) order_[i] = grid_.point(i);
  } else if (sequence) {
    column_.resize(n);
    for (unsigned axis = 0; axis < 3; ++axis) {
      for (std::uint32_t i = 0; i < n; ++i) {
        column_[i] = static_cast<std::int64_t>(relative_[axis][i]);
      }
      const auto number = static_cast<unsigned>(layout_->attributes.size()) + axis;
      code_column(coder, number, columns.kinds[number], nullptr, nullptr, column_.data(),
                  scratch_.data(), n);
    }
    for (std::uint32_t i = 0; i < n; ++i) order_[i] = i;
  } else {
    split_.code(coder, {{0, 0, 0}, size},
                {relative_[0].data(), relative_[1].data(), relative_[2].data()}, order_.data(), n);
  }
}

void BlockEncoder::encode_cluster(SymbolEncoder& coder, const Predictor& predictor,
                                  const Columns& columns) {
  const auto n = static_cast<std::uint32_t>(members_.size());
  positions(coder, columns, [&] { grid_.heights(coder, predictor, coded_box_.size[2], nullptr); });

  for (unsigned a = 0; a < layout_->attributes.size(); ++a) {
    std::swap(column_, beside_);
    column_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) column_[i] = attributes_[a][members_[order_[i]]];
    NumberForm* const form = is_floating(layout_->attributes[a]) ? &attribute_forms_[a] : nullptr;
    code_column(coder, a, columns.kinds[a], form, beside_.data(), column_.data(), scratch_.data(),
                n);
  }
  if (const unsigned level = layout_->level; level > 0) {
    column_.resize(std::size_t{n} * level);
    for (std::uint32_t i = 0; i < n; ++i) {
      for (unsigned j = 0; j < level; ++j) {
        column_[i + std::size_t{n} * j] = static_cast<std::int64_t>(
            block_->children[std::size_t{members_[order_[i]]} * level + j]);
      }
    }
    code_children(coder, level, column_.data(), n);
  }
}

void BlockEncoder::fit(PredictorFit& sums) {
  SymbolEncoder coder({});
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    if (enter(c).points > 0) positions(coder, {}, [&] { grid_.fit(sums); });
  }
}

std::uint64_t BlockEncoder::count(const Predictor& predictor, const Columns& columns,
                                  Counts& counts) {
  SymbolEncoder coder({});
  coder.counts() = std::move(counts);
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    if (enter(c).points > 0) encode_cluster(coder, predictor, columns);
  }
  counts = std::move(coder.counts());
  return coder.raw_bits();
}

void BlockEncoder::encode(const EncodingTables& tables, bool sequence, Bytes& bytes,
                          std::vector<Entry>& entries, std::vector<KeyRange>& ranges) {
  SymbolEncoder coder(tables.tables);
  const Columns columns{sequence, tables.kinds};
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    Entry entry = enter(c);
    if (entry.points > 0) {
      const std::size_t start = bytes.size();
      coder.start();
      encode_cluster(coder, tables.predictor, columns);
      std::uint32_t at = 0;
      if (representative_ != UINT32_MAX) {
        at = static_cast<std::uint32_t>(std::find(order_.begin(), order_.end(), representative_) -
                                        order_.begin());
      }
      // Most clusters' representatives fit into the coder's free 16 bits.
      if (entry.points >= kLow) coder.raw(at >> 16, 16);
      coder.finish(bytes, at & 0xffff);
      entry.bytes = static_cast<std::uint32_t>(bytes.size() - start);
      entry.checksum = crc16({bytes.data() + start, entry.bytes});
    }
    entries.push_back(entry);
    for (std::size_t a = 0; layout_->version > 1 && a < attributes_.size(); ++a) {
      ranges.push_back(range_of(a));
    }
  }
}

}  // namespace terrace::stream::store
