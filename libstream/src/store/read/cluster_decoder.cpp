// SPDX-License-Identifier: Apache-2.0
#include "store/read/cluster_decoder.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "store/codec/column.hpp"
#include "store/codec/form.hpp"

namespace terrace::stream::store {
namespace {

template <class T>
void scatter(std::span<const std::int64_t> values, std::size_t stride, std::byte* out) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const T value = static_cast<T>(values[i]);
    std::memcpy(out + i * stride, &value, sizeof value);
  }
}

void scatter(ScalarType type, NumberForm form, std::span<std::int64_t> values, std::size_t stride,
             std::byte* out) {
  switch (type) {
    case ScalarType::i8:
    case ScalarType::u8:
      return scatter<std::uint8_t>(values, stride, out);
    case ScalarType::i16:
    case ScalarType::u16:
      return scatter<std::uint16_t>(values, stride, out);
    case ScalarType::i32:
    case ScalarType::u32:
      return scatter<std::uint32_t>(values, stride, out);
    case ScalarType::i64:
    case ScalarType::u64:
      return scatter<std::uint64_t>(values, stride, out);
    case ScalarType::f32:
      for (std::int64_t& value : values) {
        if (form == kFloatBits) {
          const auto bits = static_cast<std::int32_t>(value);
          value = bits < 0 ? bits ^ INT32_MAX : bits;
        } else {
          value = std::bit_cast<std::int32_t>(static_cast<float>(to_double(value, form)));
        }
      }
      return scatter<std::uint32_t>(values, stride, out);
    case ScalarType::f64:
      for (std::int64_t& value : values) {
        if (form == kDoubleBits) {
          value = value < 0 ? value ^ INT64_MAX : value;
        } else {
          value = std::bit_cast<std::int64_t>(to_double(value, form));
        }
      }
      return scatter<std::uint64_t>(values, stride, out);
  }
}

}  // namespace

void ClusterDecoder::decode(const Layout& layout, const DecodingTables& tables, const Entry& entry,
                            ByteView bytes, bool root, ClusterPoints& out) {
  const std::uint32_t n = entry.points;
  out.has_representative = !root;
  if (n == 0) {
    if (!root) throw Damage("a cluster has no representative");
    if (!bytes.empty()) throw Damage("a cluster without points has bytes");
    out.positions.clear();
    out.payload.clear();
    out.children.clear();
    out.representative_payload.clear();
    out.representative_children.clear();
    return;
  }
  if (n > layout.max_points()) throw Damage("a cluster has too many points");
  SymbolDecoder coder(tables.tables, bytes);
  const bool placed = positions(coder, layout, tables, entry);
  payload_.resize(n * layout.payload_size);
  if (tables.guide.exists()) attribute(coder, layout, tables, tables.guide.attribute, n);
  if (!placed) sequence(coder, layout, tables, n);
  for (unsigned a = 0; a < layout.attributes.size(); ++a) {
    std::swap(column_, preceding_);
    if (a == tables.guide.attribute) {
      column_ = guide_;
    } else {
      attribute(coder, layout, tables, a, n);
    }
  }
  children_.resize(std::size_t{n} * layout.level);
  if (layout.level > 0) code_children(coder, layout.level, children_.data(), n);

  std::uint64_t upper = 0;
  if (n >= kLow) upper = coder.raw(16);
  const std::uint32_t coded = coder.finish() | static_cast<std::uint32_t>(upper) << 16;
  if (root ? coded != 0 : coded >= n)
    throw Damage("a cluster's representative is not one of its points");
  const std::uint32_t representative = root ? n : uncentred(coded, n);
  out.before_representative = root ? 0 : representative;
  deliver(entry, representative, out);
  deliver_payload(layout.payload_size, n, representative, out);
  deliver_children(layout.level, n, representative, out);
}

void ClusterDecoder::deliver_payload(std::size_t stride, std::uint32_t n,
                                     std::uint32_t representative, ClusterPoints& out) const {
  const bool root = representative == n;
  out.payload.resize((root ? n : n - 1) * stride);
  out.representative_payload.resize(root ? 0 : stride);
  if (stride == 0) return;
  const std::byte* const records = payload_.data();
  const std::size_t before = representative * stride;
  std::copy(records, records + before, out.payload.begin());
  if (root) return;
  std::copy(records + before, records + before + stride, out.representative_payload.begin());
  std::copy(records + before + stride, records + n * stride,
            out.payload.begin() + static_cast<std::ptrdiff_t>(before));
}

void ClusterDecoder::deliver_children(unsigned level, std::uint32_t n, std::uint32_t representative,
                                      ClusterPoints& out) const {
  const bool root = representative == n;
  out.children.resize(std::size_t{root ? n : n - 1} * level);
  out.representative_children.resize(root ? 0 : level);
  std::uint64_t* to = out.children.data();
  for (std::uint32_t i = 0; i < n && level > 0; ++i) {
    std::uint64_t* const at = i == representative ? out.representative_children.data() : to;
    for (unsigned j = 0; j < level; ++j) {
      at[j] = static_cast<std::uint64_t>(children_[i + std::size_t{n} * j]);
    }
    if (at == to) to += level;
  }
}

void ClusterDecoder::attribute(SymbolDecoder& coder, const Layout& layout,
                               const DecodingTables& tables, unsigned number, std::uint32_t n) {
  const ScalarType type = layout.attributes[number];
  const bool floating = type == ScalarType::f32 || type == ScalarType::f64;
  NumberForm form = kIntegerForm;
  NumberForm* const coded_form = floating ? &form : nullptr;
  column_.resize(n);
  if (number == tables.guide.attribute) {
    code_guide(coder, layout.first_context(number), tables.kinds[number], coded_form, lines_, 0,
               column_.data(), nullptr, n);
    guide_ = column_;
  } else {
    code_column(coder, layout.first_context(number), tables.kinds[number], coded_form,
                tables.guide.exists() ? &lines_ : nullptr, preceding_.data(), column_.data(),
                nullptr, n);
  }
  scatter(type, form, column_, layout.payload_size, payload_.data() + layout.offsets[number]);
}

bool ClusterDecoder::positions(SymbolDecoder& coder, const Layout& layout,
                               const DecodingTables& tables, const Entry& entry) {
  const std::uint32_t n = entry.points;
  const unsigned form = coder.symbol(context::kForm);
  if (form > (kSplitForm | kOwnBoxForm)) throw Damage("a cluster has an unknown form");
  const IntegerBox outer{{0, 0, 0}, entry.size};
  box_ = outer;
  if (form & kOwnBoxForm) code_box(coder, outer, box_);
  for (std::vector<std::uint64_t>& axis : relative_) {
    if (axis.size() < n) axis.resize(n);
  }
  if (form & kSplitForm) {
    split_.decode(coder, {{0, 0, 0}, box_.size},
                  {relative_[0].data(), relative_[1].data(), relative_[2].data()}, n);
    return true;
  }
  if (layout.has_point_columns()) return false;
  if (!GridCodec::fits(box_.size[0], box_.size[1], n)) {
    throw Damage("a cluster's box does not fit its form");
  }
  grid_.positions(coder, layout.border_context(), static_cast<std::uint32_t>(box_.size[0]),
                  static_cast<std::uint32_t>(box_.size[1]), n, relative_[0].data(),
                  relative_[1].data());
  grid_.heights(coder, tables.predictor, box_.size[2], relative_[2].data());
  const std::uint64_t highest = *std::max_element(relative_[2].begin(), relative_[2].begin() + n);
  if (highest >= box_.size[2]) throw Damage("a height is outside its cluster's box");
  return true;
}

void ClusterDecoder::sequence(SymbolDecoder& coder, const Layout& layout,
                              const DecodingTables& tables, std::uint32_t n) {
  column_.resize(n);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto number = static_cast<unsigned>(layout.attributes.size()) + axis;
    code_column(coder, layout.first_context(number), tables.kinds[number], nullptr,
                tables.guide.exists() ? &lines_ : nullptr, nullptr, column_.data(), nullptr, n);
    std::uint64_t highest = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      relative_[axis][i] = static_cast<std::uint64_t>(column_[i]);
      highest = std::max(highest, relative_[axis][i]);
    }
    if (highest >= box_.size[axis]) throw Damage("a point is outside its cluster's box");
  }
}

void ClusterDecoder::deliver(const Entry& entry, std::uint32_t representative,
                             ClusterPoints& out) const {
  const std::uint32_t n = entry.points;
  out.positions.resize(representative < n ? n - 1 : n);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t origin = static_cast<std::uint64_t>(entry.low[axis]) + box_.low[axis];
    const std::uint64_t* const values = relative_[axis].data();
    const auto convert = [&](auto form) {
      const auto number = [&](std::uint32_t i) {
        return to_double(static_cast<std::int64_t>(origin + values[i]), form);
      };
      const std::uint32_t before = std::min(representative, n);
      for (std::uint32_t i = 0; i < before; ++i) out.positions[i][axis] = number(i);
      if (representative < n) out.representative[axis] = number(representative);
      for (std::uint32_t i = before + 1; i < n; ++i) out.positions[i - 1][axis] = number(i);
    };
    if (entry.forms[axis] == kIntegerForm) {
      convert(std::integral_constant<NumberForm, kIntegerForm>{});
    } else {
      convert(entry.forms[axis]);
    }
  }
}

}  // namespace terrace::stream::store
