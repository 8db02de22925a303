// SPDX-License-Identifier: Apache-2.0
#include "store/read/index_page.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "store/codec/coding.hpp"
#include "store/codec/column.hpp"

namespace terrace::stream::store {
namespace {

/// Bits of the ends of ranges. Few, because clusters of a page are close together and so are their
/// values.
constexpr unsigned kRangeBits = 5;
/// Bits for floating-point types, tried in this order; their keys are about as far apart from 0 to
/// 1 as from 1 to 1e300.
constexpr std::array<unsigned, 4> kFloatingRangeBits{kRangeBits, 8, 11, 14};

unsigned shift_of(std::uint64_t reach, unsigned bits) {
  const auto width = static_cast<unsigned>(std::bit_width(reach));
  return width > bits ? width - bits : 0;
}

/// Returns the end of a range, moved outwards to a multiple of 2^shift, or with `up` to one less
/// than a multiple.
std::uint64_t widened(std::uint64_t key, unsigned shift, bool up) {
  const std::uint64_t mask = (std::uint64_t{1} << shift) - 1;
  return up ? key | mask : key & ~mask;
}

/// Returns the shift for the ends of ranges of doubles. It moves them by at most a 32nd of their
/// extent on average, if the bits suffice.
unsigned floating_shift(std::span<const std::uint64_t> keys, std::uint64_t lowest,
                        std::uint64_t highest, bool up) {
  const double reach = double_of_key(highest) - double_of_key(lowest);
  unsigned shift = 0;
  for (const unsigned bits : kFloatingRangeBits) {
    shift = shift_of(highest - lowest, bits);
    double movement = 0;
    for (const std::uint64_t key : keys) {
      movement += std::abs(double_of_key(widened(key, shift, up)) - double_of_key(key));
    }
    if (movement <= reach / 32 * static_cast<double>(keys.size())) break;
  }
  return shift;
}

/// Codes the columns of a page in either direction.
template <class Coder>
class PageCoder {
 public:
  PageCoder(Coder& coder, const Layout& layout)
      : coder_(coder),
        first_(layout.index_context()),
        small_(layout.small()),
        checksum_bits_(layout.checksum_bits()) {}

  void entries(PageColumns& columns) {
    for (unsigned axis = 0; axis < 3; ++axis) boxes(columns, axis);
    const auto sizes_x = columns.column(PageColumns::kSizeX);
    const auto sizes_y = columns.column(PageColumns::kSizeY);
    const auto points = columns.column(PageColumns::kPoints);
    const auto bytes = columns.column(PageColumns::kBytes);
    // Clusters of rasters fill a certain share of their boxes.
    code_residuals(points, PageColumns::kPoints, [&](std::size_t i) {
      return small_ ? sizes_x[i] * sizes_y[i] * 45 >> 6 : i > 0 ? points[i - 1] : 0;
    });
    // As many bytes per point as the previous cluster.
    code_residuals(bytes, PageColumns::kBytes, [&](std::size_t i) {
      return i > 0 ? bytes[i - 1] * points[i] / std::max<std::uint64_t>(points[i - 1], 1) : 0;
    });
    numbers(columns.column(PageColumns::kDescendants), PageColumns::kDescendants);
    // The same error relative to the size of the box as the previous cluster.
    const auto errors = columns.column(PageColumns::kError);
    const auto extent = [&](std::size_t i) {
      return error_code(static_cast<double>(sizes_x[i] + sizes_y[i]));
    };
    code_residuals(errors, PageColumns::kError, [&](std::size_t i) {
      return i > 0 ? errors[i - 1] + extent(i) - extent(i - 1) : extent(0);
    });
    differences(columns.column(PageColumns::kForms), context_of(PageColumns::kForms));
    if (small_) {
      differences(columns.column(PageColumns::kJump), context_of(PageColumns::kJump));
    }
    typename Coder::Local coder = coder_;
    for (std::uint64_t& checksum : columns.column(PageColumns::kChecksum)) {
      if constexpr (Coder::kDecoding) {
        checksum = coder.raw(checksum_bits_);
      } else {
        coder.raw(checksum, checksum_bits_);
      }
    }
    keep(coder);
  }

  void ranges(RangeColumns& columns) {
    for (unsigned end = 0; end < columns.columns(); ++end) {
      const std::span<std::uint64_t> keys = columns.column(end);
      const bool ones = end % 2 != 0;
      std::uint64_t bits = 0;
      for (const std::uint64_t key : keys) bits |= ones ? ~key : key;
      const unsigned shift_bits = shift(bits);
      // All in one context; the first relative to the lowest key.
      differences(keys, first_ + context::kIndexRange + end, {}, 1, shift_bits, ones,
                  INT64_MIN >> shift_bits);
    }
  }

 private:
  static constexpr unsigned kTop = 63;
  using Steps = std::array<std::uint8_t, kMaxPageClusters>;

  /// Loops work on a copy of a decoder, see Coder::Local.
  void keep(const Coder& coder) {
    if constexpr (Coder::kDecoding) coder_ = coder;
  }
  [[nodiscard]] unsigned context_of(unsigned field) const {
    return first_ + field * context::kIndexSteps;
  }

  /// Codes the sizes and lower ends of an axis.
  void boxes(PageColumns& columns, unsigned axis) {
    const std::span<std::uint64_t> sizes = columns.column(PageColumns::kSizeX + axis);
    const std::span<std::uint64_t> lows = columns.column(PageColumns::kLowX + axis);
    std::uint64_t bits = 0;
    for (const std::uint64_t size : sizes) bits |= size;
    for (const std::uint64_t low : lows) bits |= low;
    const unsigned shift_bits = shift(bits);
    unsigned step = 0;
    const unsigned context = context_of(PageColumns::kSizeX + axis);
    std::size_t i = 0;
    typename Coder::Local coder = coder_;
    Steps of_sizes;
    for (std::uint64_t& size : sizes) {
      std::uint64_t number = (size >> shift_bits) - 1;
      step = difference_step(code_number(coder, context + step, number));
      if constexpr (Coder::kDecoding) size = (number + 1) << shift_bits;
      of_sizes[i++] = static_cast<std::uint8_t>(step);
    }
    keep(coder);
    // A large step in x mostly means a small one in y.
    if (axis == 1) steps_ = last_steps_;
    if (axis == 2) steps_ = of_sizes;
    differences(lows, context_of(PageColumns::kLowX + axis),
                axis > 0 ? std::span<const std::uint8_t>(steps_) : std::span<const std::uint8_t>(),
                context::kIndexSteps, shift_bits);
  }

  /// Codes numbers unchanged, in contexts by the previous one.
  void numbers(std::span<std::uint64_t> values, unsigned field) {
    unsigned step = 0;
    typename Coder::Local coder = coder_;
    for (std::uint64_t& value : values) {
      step = difference_step(code_number(coder, context_of(field) + step, value));
    }
    keep(coder);
  }
  /// Codes differences from guess(i), which may depend on earlier values.
  template <class Guess>
  void code_residuals(std::span<std::uint64_t> values, unsigned field, const Guess& guess) {
    unsigned step = 0;
    typename Coder::Local coder = coder_;
    for (std::size_t i = 0; i < values.size(); ++i) {
      auto value = static_cast<std::int64_t>(values[i]);
      step = difference_step(code_difference(coder, context_of(field) + step,
                                             static_cast<std::int64_t>(guess(i)), value));
      if constexpr (Coder::kDecoding) values[i] = static_cast<std::uint64_t>(value);
    }
    keep(coder);
  }

  /// Codes differences between successive values, the first from `previous`, without the lowest
  /// bits, which are 0 or, with `ones`, 1. steps: determine the contexts; if empty, the previous
  /// difference does.
  void differences(std::span<std::uint64_t> values, unsigned context,
                   std::span<const std::uint8_t> steps = {},
                   unsigned contexts = context::kIndexSteps, unsigned shift_bits = 0,
                   bool ones = false, std::int64_t previous = 0) {
    const std::uint64_t mask = ones ? (std::uint64_t{1} << shift_bits) - 1 : 0;
    unsigned step = 0;
    typename Coder::Local coder = coder_;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!steps.empty()) step = steps[i];
      // Ranges are unsigned, but differences wrap either way.
      std::int64_t current = static_cast<std::int64_t>(values[i]) >> shift_bits;
      const unsigned number_class =
          code_difference(coder, context + step % contexts, previous, current);
      step = difference_step(number_class);
      last_steps_[i] = static_cast<std::uint8_t>(step);
      previous = current;
      if constexpr (Coder::kDecoding)
        values[i] = static_cast<std::uint64_t>(current) << shift_bits | mask;
    }
    keep(coder);
  }

  /// Codes the number of lowest bits that are 0 in all values of a column. bits: the union of the
  /// values' bits, for encoding.
  unsigned shift(std::uint64_t bits) {
    std::uint64_t shift_bits = bits == 0 ? kTop : static_cast<unsigned>(std::countr_zero(bits));
    code_number(coder_, first_ + context::kIndexShift, shift_bits);
    if (shift_bits > kTop) throw Damage("an index page has a bad column");
    return static_cast<unsigned>(shift_bits);
  }

  Coder& coder_;
  unsigned first_;
  bool small_;
  unsigned checksum_bits_;
  Steps steps_{}, last_steps_{};  ///< last_steps_: those of the last differences
};

Bytes padded_copy(ByteView bytes) {
  // The check shows the compiler that the sum does not wrap.
  Bytes room(memory_size(bytes.size()) + 2 * kPadding);
  std::copy(bytes.begin(), bytes.end(), room.begin() + kPadding);
  return room;
}

/// Calls use(PageCoder) for a padded string of symbols. Returns the number in its last state.
template <class Use>
std::uint32_t decode_symbols(const Bytes& padded, const Layout& layout,
                             const DecodingTables& tables, Use&& use) {
  SymbolDecoder decoder(tables.tables,
                        ByteView(padded).subspan(kPadding, padded.size() - 2 * kPadding));
  use(PageCoder(decoder, layout));
  return decoder.finish();
}

}  // namespace

PageColumns::PageColumns(std::span<const Entry> entries)
    : PageColumns(static_cast<std::uint32_t>(entries.size())) {
  assert(!entries.empty() && entries.size() <= kMaxPageClusters);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Entry& entry = entries[i];
    const auto put = [&](std::size_t field, std::uint64_t value) { column(field)[i] = value; };
    for (unsigned axis = 0; axis < 3; ++axis) {
      put(kSizeX + axis, entry.size[axis]);
      put(kLowX + axis, static_cast<std::uint64_t>(entry.low[axis]));
    }
    put(kBytes, entry.bytes);
    put(kPoints, entry.points);
    put(kError, entry.error);
    put(kDescendants, entry.descendants);
    put(kForms, (entry.forms[0] * kNumberForms + entry.forms[1]) * kNumberForms + entry.forms[2]);
    put(kJump, static_cast<std::uint64_t>(entry.jump));
    put(kChecksum, entry.checksum);
  }
}

RangeColumns::RangeColumns(std::span<const KeyRange> ranges, std::span<const ScalarType> types)
    : RangeColumns(static_cast<std::uint32_t>(types.empty() ? 1 : ranges.size() / types.size()),
                   types.size()) {
  for (std::size_t a = 0; a < types.size(); ++a) {
    for (std::size_t i = 0; i < clusters(); ++i) {
      column(2 * a)[i] = ranges[i * types.size() + a].low;
      column(2 * a + 1)[i] = ranges[i * types.size() + a].high;
    }
  }
  for (std::size_t end = 0; end < columns(); ++end) {
    const std::span<std::uint64_t> keys = column(end);
    const ScalarType type = types[end / 2];
    const auto [lowest, highest] = std::minmax_element(keys.begin(), keys.end());
    const bool up = end % 2 != 0;
    const unsigned shift = type == ScalarType::f32 || type == ScalarType::f64
                               ? floating_shift(keys, *lowest, *highest, up)
                               : shift_of(*highest - *lowest, kRangeBits);
    for (std::uint64_t& key : keys) key = widened(key, shift, up);
  }
}

void PageContent::count(const Layout& layout,
                        std::span<std::array<std::uint32_t, kSymbols>> counts) {
  SymbolCounter counter(counts);
  PageCoder coder(counter, layout);
  coder.entries(entries);
  coder.ranges(ranges);
}

void PageContent::write(const Layout& layout, const EncodingTables& tables, Bytes& out) {
  const std::size_t start = out.size();
  Bytes coded_ranges;
  SymbolEncoder encoder(tables.tables);
  if (ranges.columns() > 0) {
    encoder.start();
    PageCoder(encoder, layout).ranges(ranges);
    encoder.finish(0, coded_ranges);
  }
  put_varint(out, offset >> 16);
  if (ranges.columns() > 0) put_varint(out, coded_ranges.size());
  encoder.start();
  PageCoder(encoder, layout).entries(entries);
  encoder.finish(static_cast<std::uint32_t>(offset & 0xffff), out);
  out.insert(out.end(), coded_ranges.begin(), coded_ranges.end());
  put(out, crc16({out.data() + start, out.size() - start}));
}

CodedPage read_page(ByteView bytes, std::uint32_t clusters, const Layout& layout,
                    const DecodingTables& tables) {
  assert(clusters >= 1 && clusters <= layout.page_clusters());
  constexpr std::size_t kChecksum = sizeof(std::uint16_t);
  if (bytes.size() < kChecksum) throw Damage("an index page has a wrong size");
  const ByteView checksum = bytes.last(kChecksum);
  bytes = bytes.first(bytes.size() - kChecksum);
  if (crc16(bytes) != load<std::uint16_t>(checksum.data())) {
    throw Damage("the checksum of an index page is wrong");
  }
  CodedPage page{0, PageColumns(clusters), {}};
  ByteReader in(bytes);
  const std::uint64_t upper = in.varint();
  if (upper >> 48 != 0) throw Damage("an index entry is out of range");
  const std::uint64_t ranges_bytes = layout.attributes.empty() ? 0 : in.varint();
  if (ranges_bytes > in.remaining()) throw Damage("the data end too early");
  const ByteView entries = in.take(in.remaining() - static_cast<std::size_t>(ranges_bytes));
  page.ranges = padded_copy(in.take(in.remaining()));
  page.offset = upper << 16 | decode_symbols(padded_copy(entries), layout, tables,
                                             [&](auto coder) { coder.entries(page.entries); });
  return page;
}

RangeColumns read_ranges(const Bytes& coded, std::uint32_t clusters, const Layout& layout,
                         const DecodingTables& tables) {
  RangeColumns columns(clusters, layout.attributes.size());
  if (layout.attributes.empty()) return columns;
  if (decode_symbols(coded, layout, tables, [&](auto coder) { coder.ranges(columns); }) != 0) {
    throw Damage("an index page does not end correctly");
  }
  return columns;
}

IndexPage::IndexPage(ByteView bytes, std::uint32_t clusters, const Layout& layout,
                     const DecodingTables& tables)
    : clusters_(clusters) {
  CodedPage page = read_page(bytes, clusters, layout, tables);
  if (!layout.attributes.empty()) ranges_ = std::move(page.ranges);
  std::uint64_t at = page.offset;
  for (std::uint32_t i = 0; i < clusters_; ++i) {
    const std::uint64_t size = page.entries.column(Field::kBytes)[i];
    std::uint64_t& offset = page.entries.column(kOffset)[i];
    at += offset;  // beyond the file if the offset is out of range
    if (size >= kMaxBytes || at > UINT64_MAX - size) {
      throw Damage("an index entry is out of range");
    }
    offset = at;
    at += size;
  }
  keep(page.entries);
}

void IndexPage::keep(const PageColumns& columns) {
  std::uint32_t end = 0;
  bytes_.reserve(columns_.size() * clusters_ + sizeof(std::uint64_t));  // usually enough
  for (std::size_t f = 0; f < columns_.size(); ++f) {
    const auto values = columns.column(f);
    std::uint64_t differences = 0;
    for (const std::uint64_t value : values) differences |= value ^ values[0];
    Column& column = columns_[f];
    // The bits above and below those in which the values differ are the same in all.
    const auto bits = static_cast<unsigned>(std::bit_width(differences));
    column.shift = static_cast<std::uint8_t>(differences == 0 ? 0 : std::countr_zero(differences));
    column.width = static_cast<std::uint8_t>((bits - column.shift + 7) / 8);
    column.mask = column.width == 8 ? UINT64_MAX : (std::uint64_t{1} << 8 * column.width) - 1;
    column.base = values[0] & ~(column.mask << column.shift);
    column.start = end;
    end += column.width * clusters_;
    bytes_.resize(end + sizeof(std::uint64_t));
    // Each store overwrites the extra bytes of the previous one.
    std::uint8_t* to = bytes_.data() + column.start;
    for (const std::uint64_t value : values) {
      const std::uint64_t stored = value >> column.shift;
      std::memcpy(to, &stored, sizeof stored);
      to += column.width;
    }
  }
}

std::uint64_t IndexPage::value(Field field, std::uint32_t i) const {
  const Column& column = columns_[field];
  const auto stored =
      load<std::uint64_t>(bytes_.data() + column.start + std::size_t{i} * column.width);
  return column.base | (stored & column.mask) << column.shift;
}

Entry IndexPage::entry(std::uint32_t i) const {
  assert(i < clusters_);
  Entry entry;
  const std::uint64_t bytes = value(Field::kBytes, i), points = value(Field::kPoints, i);
  std::uint64_t forms = value(Field::kForms, i);
  const std::uint64_t error = value(Field::kError, i), checksum = value(Field::kChecksum, i);
  if (points > kMaxPoints || error > error_code(std::numeric_limits<double>::infinity()) ||
      checksum > UINT16_MAX) {
    throw Damage("an index entry is out of range");
  }
  entry.bytes = static_cast<std::uint32_t>(bytes);
  entry.points = static_cast<std::uint32_t>(points);
  for (unsigned axis = 3; axis-- > 0; forms /= kNumberForms) {
    entry.forms[axis] = static_cast<NumberForm>(forms % kNumberForms);
    entry.low[axis] = static_cast<std::int64_t>(value(static_cast<Field>(Field::kLowX + axis), i));
    entry.size[axis] = value(static_cast<Field>(Field::kSizeX + axis), i);
    if (entry.size[axis] == 0) throw Damage("an index entry has an empty box");
  }
  if (forms != 0) throw Damage("an index entry has an unknown number form");
  entry.error = static_cast<std::uint16_t>(error);
  entry.descendants = value(Field::kDescendants, i);
  entry.checksum = static_cast<std::uint16_t>(checksum);
  if (i > 0) entry.jump = static_cast<std::int64_t>(offset(i) - end(i - 1));
  return entry;
}

}  // namespace terrace::stream::store
