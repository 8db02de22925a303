// SPDX-License-Identifier: Apache-2.0
#include "store/write/block_encoder.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>

#include <fmt/core.h>

#include "differing_bits.hpp"
#include "io/text.hpp"
#include "store/codec/column.hpp"
#include "store/codec/form.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

/// Bits of a block's extent in steps of its boxes. Boxes of clusters are enlarged to multiples of
/// 1/2048 of the block, which costs a thousandth of a bit per point and saves half of the index.
constexpr unsigned kBoxBits = 11;

/// Returns the maximum shift of a form: a box enlarged to multiples of 2^shift must still be finite
/// (see record_of()).
unsigned max_shift(NumberForm form) {
  if (form == kFloatBits) return 23;
  return form == kDoubleBits ? 52 : 40;
}

bool is_floating(ScalarType type) { return type == ScalarType::f32 || type == ScalarType::f64; }

bool is_integer(double value) {
  return std::abs(value) < 0x1p53 &&
         std::bit_cast<std::uint64_t>(static_cast<double>(static_cast<std::int64_t>(value))) ==
             std::bit_cast<std::uint64_t>(value);
}

template <class T>
void gather_integers(const std::byte* payload, std::size_t stride,
                     std::span<const std::uint32_t> points, std::int64_t* out) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    T value;
    std::memcpy(&value, payload + points[i] * stride, sizeof value);
    // The sign of int8 is intended.
    out[i] = static_cast<std::int64_t>(value);  // NOLINT(bugprone-signed-char-misuse)
  }
}

/// Gathers one attribute of some points: integers, or the bits of floating-point types.
void gather_integers(ScalarType type, const std::byte* payload, std::size_t stride,
                     std::span<const std::uint32_t> points, std::int64_t* out) {
  switch (type) {
    case ScalarType::i8:
      return gather_integers<std::int8_t>(payload, stride, points, out);
    case ScalarType::u8:
      return gather_integers<std::uint8_t>(payload, stride, points, out);
    case ScalarType::i16:
      return gather_integers<std::int16_t>(payload, stride, points, out);
    case ScalarType::u16:
      return gather_integers<std::uint16_t>(payload, stride, points, out);
    case ScalarType::i32:
    case ScalarType::f32:
      return gather_integers<std::int32_t>(payload, stride, points, out);
    case ScalarType::u32:
      return gather_integers<std::uint32_t>(payload, stride, points, out);
    case ScalarType::i64:
    case ScalarType::f64:
      return gather_integers<std::int64_t>(payload, stride, points, out);
    case ScalarType::u64:
      return gather_integers<std::uint64_t>(payload, stride, points, out);
  }
}

/// Returns the range of an attribute's column, as keys.
KeyRange range_of(ScalarType type, NumberForm form, std::span<const std::int64_t> values) {
  if (values.empty()) return {0, UINT64_MAX};
  if (type == ScalarType::u64) {
    KeyRange range;
    for (const std::int64_t number : values) {
      const auto value = static_cast<std::uint64_t>(number);
      range = {std::min(range.low, value), std::max(range.high, value)};
    }
    return range;
  }
  const auto [low, high] = extent_of(values);
  if (!is_floating(type)) return {attribute_key(low), attribute_key(high)};
  // Number forms keep the order, with NaN at its ends.
  return {attribute_key(to_double(low, form)), attribute_key(to_double(high, form))};
}

/// Counts the symbols of a cluster's columns in each kind, and nothing else.
class KindCounter {
 public:
  static constexpr bool kDecoding = false;
  using Local = KindCounter&;

  explicit KindCounter(KindCounts& trials) : trials_(trials) {}

  void symbol(unsigned /*context*/, unsigned /*symbol*/) {}
  void raw(std::uint64_t /*value*/, unsigned /*bits*/) {}
  template <class Code>
  void column(unsigned number, Code&& code) {
    for (const ColumnKind kind : trials_.kinds[number]) {
      SymbolCounter counter(trials_.counts[static_cast<std::size_t>(kind)]);
      code(counter, kind);
    }
  }

 private:
  KindCounts& trials_;
};

/// Calls `code` for a column with its kind, or with each kind that is tried.
template <class Coder, class Code>
void code_as_kinds(Coder& coder, const Columns& columns, unsigned number, Code&& code) {
  if constexpr (std::is_same_v<Coder, KindCounter>) {
    coder.column(number, code);
  } else {
    code(coder, columns.kinds[number]);
  }
}

}  // namespace

void BlockEncoder::load(const Layout& layout, const ClusteredBlock& block) {
  layout_ = &layout;
  block_ = &block;
  load_axes();
  load_attributes();
}

void BlockEncoder::load_axes() {
  const std::span<const std::uint32_t> order = block_->order;
  std::array<std::int64_t*, 3> out{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    axes_[axis].resize(order.size());
    out[axis] = axes_[axis].data();
  }
  // As integers without branches, because nearly every raster and laser scan takes this path.
  std::array<std::uint64_t, 3> differences{};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Point3& position = block_->positions[order[i]];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = position[axis];
      const auto k = static_cast<std::int64_t>(std::abs(value) < 0x1p53 ? value : 0.5);
      differences[axis] |= std::bit_cast<std::uint64_t>(static_cast<double>(k)) ^
                           std::bit_cast<std::uint64_t>(value);
      out[axis][i] = k;
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto box_is_integer = [&](const ClusterSummary& summary) {
      return summary.box.empty() ||
             (is_integer(summary.box.min[axis]) && is_integer(summary.box.max[axis]));
    };
    forms_[axis] = kIntegerForm;
    if (differences[axis] != 0 ||
        !std::all_of(block_->summaries.begin(), block_->summaries.end(), box_is_integer)) {
      load_decimals(axis);
    }
    measure(axis);
  }
}

void BlockEncoder::load_decimals(std::size_t axis) {
  const std::size_t n = block_->order.size();
  doubles_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    doubles_[i] = block_->positions[block_->order[i]][axis];
    if (!std::isfinite(doubles_[i])) {
      throw Error({}, "a point has a coordinate that is not finite").remedy("remove such points");
    }
  }
  for (const ClusterSummary& summary : block_->summaries) {
    if (summary.box.empty()) continue;
    doubles_.push_back(summary.box.min[axis]);
    doubles_.push_back(summary.box.max[axis]);
  }
  forms_[axis] = form_of(doubles_);
  for (std::size_t i = 0; i < n; ++i) axes_[axis][i] = to_integer(doubles_[i], forms_[axis]);
}

/// Determines the extents of the clusters, and the steps of their boxes from the extent of the
/// block.
void BlockEncoder::measure(std::size_t axis) {
  const std::size_t clusters = block_->representatives.size();
  const std::int64_t* const values = axes_[axis].data();
  extents_[axis].resize(clusters);
  Extent block_extent;
  for (std::size_t c = 0; c < clusters; ++c) {
    const Extent extent =
        extent_of({values + block_->first[c], block_->first[c + 1] - block_->first[c]});
    extents_[axis][c] = extent;
    block_extent.low = std::min(block_extent.low, extent.low);
    block_extent.high = std::max(block_extent.high, extent.high);
  }
  for (const ClusterSummary& summary : block_->summaries) {
    if (summary.box.empty()) continue;
    block_extent.low = std::min(block_extent.low, to_integer(summary.box.min[axis], forms_[axis]));
    block_extent.high =
        std::max(block_extent.high, to_integer(summary.box.max[axis], forms_[axis]));
  }
  const auto extent = block_extent.low > block_extent.high
                          ? 0
                          : static_cast<std::uint64_t>(block_extent.high) -
                                static_cast<std::uint64_t>(block_extent.low);
  const auto bits = static_cast<unsigned>(std::bit_width(extent));
  shifts_[axis] = std::min(bits > kBoxBits ? bits - kBoxBits : 0, max_shift(forms_[axis]));
}

void BlockEncoder::load_attributes() {
  attributes_.resize(layout_->attributes.size());
  find_differing_bits(block_->payload, layout_->payload_size, differing_);
  std::size_t offset = 0;
  for (std::size_t a = 0; a < attributes_.size(); ++a) {
    Attribute& attribute = attributes_[a];
    attribute.type = layout_->attributes[a];
    attribute.offset = offset;
    attribute.form = kIntegerForm;
    const std::size_t size = size_of(attribute.type);
    const auto differing = std::span(differing_).subspan(offset, size);
    attribute.one_value = std::all_of(differing.begin(), differing.end(),
                                      [](std::byte bits) { return bits == std::byte{0}; });
    if (is_floating(attribute.type)) {
      load_numbers(attribute);
    } else if (attribute.one_value && !block_->payload.empty()) {
      constexpr std::array<std::uint32_t, 1> kFirst{0};
      gather_integers(attribute.type, block_->payload.data() + offset, 0, kFirst, &attribute.value);
    }
    offset += size;
  }
}

/// Loads the values of a floating-point type: one for all points, or one for each.
void BlockEncoder::load_numbers(Attribute& attribute) {
  const bool single = attribute.type == ScalarType::f32;
  std::size_t count = block_->positions.size();
  if (attribute.one_value) count = std::min<std::size_t>(count, 1);
  std::vector<std::int64_t>& numbers = attribute.numbers;
  numbers.resize(count);
  doubles_.resize(count);
  const std::byte* at = block_->payload.data() + attribute.offset;
  for (std::size_t i = 0; i < count; ++i, at += layout_->payload_size) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(at);
    numbers[i] = single ? store::load<std::int32_t>(bytes) : store::load<std::int64_t>(bytes);
    doubles_[i] = single ? store::load<float>(bytes) : store::load<double>(bytes);
  }
  NumberForm form = form_of(doubles_);
  if (form == kDoubleBits && single) form = kFloatBits;
  attribute.form = form;
  for (std::size_t i = 0; i < count; ++i) {
    // From the bits if the form has bits, because arithmetic would change a signalling NaN.
    if (form == kFloatBits && single) {
      const auto bits = static_cast<std::int32_t>(numbers[i]);
      numbers[i] = bits < 0 ? bits ^ INT32_MAX : bits;
    } else if (form == kDoubleBits) {
      numbers[i] = numbers[i] < 0 ? numbers[i] ^ INT64_MAX : numbers[i];
    } else {
      numbers[i] = to_integer(doubles_[i], form);
    }
  }
  if (count > 0) attribute.value = numbers[0];
}

Entry BlockEncoder::enter(std::size_t cluster) {
  first_ = block_->first[cluster];
  members_ = block_->order.subspan(first_, block_->first[cluster + 1] - first_);
  const auto n = static_cast<std::uint32_t>(members_.size());
  if (n > layout_->max_points()) {
    throw Error({}, fmt::format("a cluster has {} of this size, more than the limit of {}",
                                counted(n, "point"), layout_->max_points()))
        .remedy("make the blocks smaller");
  }
  Entry entry;
  entry.points = n;
  entry.forms = forms_;
  own_box_ = false;
  if (n == 0) return entry;
  const ClusterSummary* summary =
      cluster < block_->summaries.size() ? &block_->summaries[cluster] : nullptr;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = extents_[axis][cluster];
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
    const std::uint64_t slack = entry.size[axis] - coded_box_.size[axis];
    own_box_ |= slack > 2 * step && slack > coded_box_.size[axis] / 16;
  }
  if (!own_box_) coded_box_ = entry_box_;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    origin_[axis] = static_cast<std::uint64_t>(entry.low[axis]) + coded_box_.low[axis];
  }
  if (summary != nullptr) {
    if (!(summary->error >= 0)) {
      throw Error({}, "a cluster's error is negative or NaN");
    }
    entry.error = error_code(std::abs(summary->error));
    entry.descendants = layout_->level == 0 ? 0 : summary->descendants;
  }
  return entry;
}

void BlockEncoder::find_relative() {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    relative_[axis].resize(members_.size());
    const std::int64_t* const values = axes_[axis].data() + first_;
    for (std::size_t i = 0; i < members_.size(); ++i) {
      relative_[axis][i] = static_cast<std::uint64_t>(values[i]) - origin_[axis];
    }
  }
}

template <class Coder, class Use>
bool BlockEncoder::positions(Coder& coder, const Columns& columns, Use&& heights) {
  const auto n = static_cast<std::uint32_t>(members_.size());
  const auto& size = coded_box_.size;
  const bool sequence = columns.sequence && n > 1;
  bool grid = layout_->grid && layout_->level == 0 && GridCodec::fits(size[0], size[1], n);
  if (grid || sequence) find_relative();
  grid =
      grid && grid_.enter(static_cast<std::uint32_t>(size[0]), static_cast<std::uint32_t>(size[1]),
                          relative_[0].data(), relative_[1].data(), relative_[2].data(), n);
  coder.symbol(context::kForm, (grid || sequence ? 0 : kSplitForm) | (own_box_ ? kOwnBoxForm : 0));
  if (own_box_) code_box(coder, entry_box_, coded_box_);
  order_.resize(n);
  scratch_.resize(n);
  if (grid) {
    grid_.positions(coder, layout_->border_context(), static_cast<std::uint32_t>(size[0]),
                    static_cast<std::uint32_t>(size[1]), n, nullptr, nullptr);
    heights();
    for (std::uint32_t i = 0; i < n; ++i) order_[i] = grid_.point(i);
  } else if (sequence) {
    std::iota(order_.begin(), order_.end(), 0u);
  } else {
    const auto at = [&](std::size_t axis, std::uint32_t i) {
      return static_cast<std::uint64_t>(axes_[axis][first_ + i]) - origin_[axis];
    };
    split_.encode(coder, size, at, n, order_.data());
  }
  return !sequence;
}

/// Codes the coordinates of points in their order.
template <class Coder>
void BlockEncoder::sequence(Coder& coder, const Columns& columns) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto number = static_cast<unsigned>(layout_->attributes.size()) + axis;
    column_.assign(relative_[axis].begin(), relative_[axis].end());
    code_as_kinds(coder, columns, number, [&](auto& column_coder, ColumnKind kind) {
      code_column(column_coder, layout_->first_context(number), kind, nullptr,
                  columns.guide.exists() ? &lines_ : nullptr, nullptr, column_.data(), &scratch_,
                  static_cast<std::uint32_t>(members_.size()));
    });
  }
}

NumberForm* BlockEncoder::coded_form(Attribute& attribute) {
  return is_floating(attribute.type) ? &attribute.form : nullptr;
}

/// Copies the values of the current cluster's points to column_, in the order of coding.
void BlockEncoder::gather(const Attribute& attribute) {
  column_.resize(coded_.size());
  if (!is_floating(attribute.type)) {
    return gather_integers(attribute.type, block_->payload.data() + attribute.offset,
                           layout_->payload_size, coded_, column_.data());
  }
  for (std::size_t i = 0; i < coded_.size(); ++i) {
    column_[i] = attribute.one_value ? attribute.value : attribute.numbers[coded_[i]];
  }
}

template <class Coder>
void BlockEncoder::encode_cluster(Coder& coder, const Predictor& predictor,
                                  const Columns& columns) {
  const auto n = static_cast<std::uint32_t>(members_.size());
  const bool placed = positions(
      coder, columns, [&] { grid_.heights(coder, predictor, coded_box_.size[2], nullptr); });
  coded_.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) coded_[i] = members_[order_[i]];

  if (columns.guide.exists()) {
    const unsigned a = columns.guide.attribute;
    gather(attributes_[a]);
    code_as_kinds(coder, columns, a, [&](auto& column_coder, ColumnKind kind) {
      code_guide(column_coder, layout_->first_context(a), kind, coded_form(attributes_[a]), lines_,
                 columns.guide.min_jump, column_.data(), &scratch_, n);
    });
    std::swap(column_, guide_);
  }
  const Lines* const lines = columns.guide.exists() ? &lines_ : nullptr;
  if (!placed) sequence(coder, columns);
  bool has_preceding = false;  // whether the preceding column has several values
  for (unsigned a = 0; a < attributes_.size(); ++a) {
    Attribute& attribute = attributes_[a];
    NumberForm* const form = coded_form(attribute);
    const unsigned first = layout_->first_context(a);
    if (a == columns.guide.attribute) {
      column_ = guide_;
      ranges_.push_back(range_of(attribute.type, attribute.form, column_));
    } else if (attribute.one_value) {
      std::int64_t value = attribute.value;
      ranges_.push_back(range_of(attribute.type, attribute.form, {&value, 1}));
      code_as_kinds(coder, columns, a, [&](auto& column_coder, ColumnKind kind) {
        code_column(column_coder, first, kind, form, nullptr, nullptr, &value, &scratch_, 1);
      });
    } else {
      std::swap(column_, preceding_);
      gather(attribute);
      ranges_.push_back(range_of(attribute.type, attribute.form, column_));
      code_as_kinds(coder, columns, a, [&](auto& column_coder, ColumnKind kind) {
        code_column(column_coder, first, kind, form, lines,
                    has_preceding ? preceding_.data() : nullptr, column_.data(), &scratch_, n);
      });
    }
    has_preceding = !attribute.one_value;
  }
  if (const unsigned level = layout_->level; level > 0) {
    column_.resize(std::size_t{n} * level);
    for (std::uint32_t i = 0; i < n; ++i) {
      for (unsigned j = 0; j < level; ++j) {
        column_[i + std::size_t{n} * j] =
            static_cast<std::int64_t>(block_->children[std::size_t{coded_[i]} * level + j]);
      }
    }
    code_children(coder, level, column_.data(), n);
  }
}

void BlockEncoder::fit(PredictorFit& sums) {
  Counts counts(layout_->contexts());
  SymbolCounter coder(counts);
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    if (enter(c).points > 0) positions(coder, {}, [&] { grid_.fit(sums); });
  }
}

void BlockEncoder::count_differences(unsigned attribute, std::array<std::uint64_t, 65>& widths) {
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    const std::uint32_t begin = block_->first[c], end = block_->first[c + 1];
    coded_.assign(block_->order.begin() + begin, block_->order.begin() + end);
    gather(attributes_[attribute]);
    for (std::size_t i = 1; i < column_.size(); ++i) {
      const auto bits = static_cast<std::uint64_t>(wrapped_difference(column_[i], column_[i - 1]));
      ++widths[static_cast<std::size_t>(std::bit_width(bits >> 63 != 0 ? -bits : bits))];
    }
  }
}

std::uint64_t BlockEncoder::count(const Predictor& predictor, const Columns& columns,
                                  Counts& counts) {
  counts.resize(layout_->contexts());
  SymbolCounter coder(counts);
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    ranges_.clear();
    if (enter(c).points > 0) encode_cluster(coder, predictor, columns);
  }
  return coder.raw_bits();
}

void BlockEncoder::count_kinds(const Predictor& predictor, bool sequence, const Guide& guide,
                               KindCounts& trials) {
  for (Counts& counts : trials.counts) counts.resize(layout_->contexts());
  KindCounter coder(trials);
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    ranges_.clear();
    if (enter(c).points > 0) encode_cluster(coder, predictor, {sequence, guide, {}});
  }
}

std::uint32_t BlockEncoder::coded_representative(std::size_t cluster) const {
  const std::uint32_t point = block_->representatives[cluster];
  if (point == kNoRepresentative) return 0;
  const auto entry = std::find(coded_.begin(), coded_.end(), point);
  assert(entry != coded_.end() && "a representative is a point of its cluster");
  return centred(static_cast<std::uint32_t>(entry - coded_.begin()),
                 static_cast<std::uint32_t>(coded_.size()));
}

void BlockEncoder::encode(const EncodingTables& tables, bool sequence, Bytes& bytes,
                          std::vector<Entry>& entries, std::vector<KeyRange>& ranges) {
  const Columns columns{sequence, tables.guide, tables.kinds};
  constexpr std::size_t kBatch = SymbolEncoder::kBatch;
  std::vector<SymbolEncoder> coders(kBatch, SymbolEncoder(tables.tables));
  std::array<std::uint32_t, kBatch> last{};
  std::array<std::size_t, kBatch> entry_of{};
  std::size_t pending = 0;
  const auto finish = [&] {
    std::size_t start = bytes.size();
    const std::span sizes = std::span(last).first(pending);
    SymbolEncoder::finish(std::span(coders).first(pending), sizes, bytes);
    for (std::size_t i = 0; i < pending; ++i) {
      Entry& entry = entries[entry_of[i]];
      entry.bytes = sizes[i];
      entry.checksum = layout_->checksum({bytes.data() + start, sizes[i]});
      start += sizes[i];
    }
    pending = 0;
  };
  for (std::size_t c = 0; c < block_->representatives.size(); ++c) {
    entries.push_back(enter(c));
    ranges_.clear();
    if (entries.back().points > 0) {
      SymbolEncoder& coder = coders[pending];
      coder.start();
      encode_cluster(coder, tables.predictor, columns);
      const std::uint32_t at = coded_representative(c);
      // The positions of most representatives fit into the coder's free 16 bits.
      if (entries.back().points >= kLow) coder.raw(at >> 16, 16);
      last[pending] = at & 0xffff;
      entry_of[pending] = entries.size() - 1;
      if (++pending == kBatch) finish();
    } else {
      ranges_.assign(attributes_.size(), {0, UINT64_MAX});
    }
    ranges.insert(ranges.end(), ranges_.begin(), ranges_.end());
  }
  finish();
}

}  // namespace terrace::stream::store
