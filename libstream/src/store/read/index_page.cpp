// SPDX-License-Identifier: Apache-2.0
#include "store/read/index_page.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "store/codec/coding.hpp"
#include "store/codec/column_codec.hpp"

namespace terrace::stream::store {
namespace {

/// Bits of the ends of ranges: a page's clusters lie together, and so do their values.
constexpr unsigned kRangeBits = 5;
/// The same for floating types, whose keys are as far apart from 0 to 1 as from 1 to 1e300.
constexpr std::array<unsigned, 4> kFloatingRangeBits{kRangeBits, 8, 11, 14};

unsigned shift_of(std::uint64_t reach, unsigned bits) {
  const auto width = static_cast<unsigned>(std::bit_width(reach));
  return width > bits ? width - bits : 0;
}

/// The end of a range, moved outwards to a multiple of 2^shift (`up`: to one less than a multiple).
std::uint64_t widened(std::uint64_t key, unsigned shift, bool up) {
  const std::uint64_t mask = (std::uint64_t{1} << shift) - 1;
  return up ? key | mask : key & ~mask;
}

/// The shift for the ends of ranges of doubles: the mean one moves by a 32nd of their reach at most
/// where so many bits are enough.
unsigned floating_shift(std::span<const std::uint64_t> keys, std::uint64_t least,
                        std::uint64_t most, bool up) {
  const double reach = double_of_key(most) - double_of_key(least);
  unsigned shift = 0;
  for (const unsigned bits : kFloatingRangeBits) {
    shift = shift_of(most - least, bits);
    double moved = 0;
    for (const std::uint64_t key : keys) {
      moved += std::abs(double_of_key(widened(key, shift, up)) - double_of_key(key));
    }
    if (moved <= reach / 32 * static_cast<double>(keys.size())) break;
  }
  return shift;
}

/// The columns of a page, in either direction.
template <class Coder>
class PageCoder {
 public:
  PageCoder(Coder& coder, const Layout& layout, PageColumns& columns)
      : coder_(coder), first_(layout.index_context()), columns_(columns) {}

  void run() {
    for (unsigned axis = 0; axis < 3; ++axis) boxes(axis);
    numbers(PageColumns::kBytes, steps_);
    for (const auto field : {PageColumns::kPoints, PageColumns::kDescendants}) numbers(field, {});
    for (const auto field : {PageColumns::kError, PageColumns::kForms}) {
      differences(field, context_of(field), context::kIndexSteps, 0, false);
    }
    typename Coder::Local coder = coder_;
    for (std::uint64_t& checksum : columns_.column(PageColumns::kChecksum)) {
      if constexpr (Coder::kDecoding) {
        checksum = coder.raw(16);
      } else {
        coder.raw(checksum, 16);
      }
    }
    keep(coder);
    for (std::size_t end = 0; end < 2 * columns_.attributes(); ++end) {
      differences(PageColumns::kFields + end,
                  first_ + context::kIndexRange + static_cast<unsigned>(end), 1,
                  shift(PageColumns::kFields + end), end % 2 != 0);
    }
  }

 private:
  static constexpr unsigned kTop = 63;

  /// Loops work on a copy of a decoder, see Coder::Local.
  void keep(const Coder& coder) {
    if constexpr (Coder::kDecoding) coder_ = coder;
  }
  using Steps = std::array<std::uint8_t, kMostPageClusters>;

  [[nodiscard]] unsigned context_of(unsigned field) const {
    return first_ + field * context::kIndexSteps;
  }

  /// Sizes and lower ends of an axis. Leaves the steps of the sizes in steps_.
  void boxes(unsigned axis) {
    const unsigned by = shift(PageColumns::kSizeX + axis);
    unsigned step = 0;
    const unsigned context = context_of(PageColumns::kSizeX + axis);
    std::size_t i = 0;
    typename Coder::Local coder = coder_;
    for (std::uint64_t& size : columns_.column(PageColumns::kSizeX + axis)) {
      std::uint64_t number = (size >> by) - 1;
      step = difference_step(code_number(coder, context + step, number));
      if constexpr (Coder::kDecoding) size = (number + 1) << by;
      steps_[i++] = static_cast<std::uint8_t>(step);
    }
    keep(coder);
    differences(PageColumns::kLowX + axis, context_of(PageColumns::kLowX + axis),
                context::kIndexSteps, by, false, axis == 2 ? &steps_ : nullptr);
  }

  /// Numbers as they are, in contexts by `steps` or, without, by the previous one.
  void numbers(unsigned field, const std::span<const std::uint8_t> steps) {
    unsigned step = 0;
    std::size_t i = 0;
    typename Coder::Local coder = coder_;
    for (std::uint64_t& value : columns_.column(field)) {
      if (!steps.empty()) step = steps[i++];
      step = difference_step(code_number(coder, context_of(field) + step, value));
    }
    keep(coder);
  }

  /// Differences of neighbours, the first from 0, of values without their lowest bits, which are 0
  /// or, with `ones`, 1.
  void differences(std::size_t field, unsigned context, unsigned contexts, unsigned by, bool ones,
                   const Steps* steps = nullptr) {
    const std::uint64_t mask = ones ? (std::uint64_t{1} << by) - 1 : 0;
    unsigned step = 0;
    std::int64_t previous = 0;
    std::size_t i = 0;
    typename Coder::Local coder = coder_;
    for (std::uint64_t& value : columns_.column(field)) {
      if (steps != nullptr) step = (*steps)[i++];
      // Ranges are unsigned, but differences of either kind wrap.
      std::int64_t now = static_cast<std::int64_t>(value) >> by;
      const unsigned found = code_difference(coder, context + step % contexts, previous, now);
      step = difference_step(found);
      previous = now;
      if constexpr (Coder::kDecoding) value = static_cast<std::uint64_t>(now) << by | mask;
    }
    keep(coder);
  }

  /// The number of lowest bits that all values of a column lack.
  unsigned shift(std::size_t field) {
    std::uint64_t by = 0;
    if constexpr (!Coder::kDecoding) by = common_zeros(field);
    code_number(coder_, first_ + context::kIndexShift, by);
    if (by > kTop) throw Damage("an index page has a bad column");
    return static_cast<unsigned>(by);
  }
  [[nodiscard]] unsigned common_zeros(std::size_t field) const {
    const bool ones = field >= PageColumns::kFields && (field - PageColumns::kFields) % 2 != 0;
    std::uint64_t bits = 0;
    for (const std::uint64_t value : columns_.column(field)) bits |= ones ? ~value : value;
    if (field < PageColumns::kLowX) {
      for (const std::uint64_t low : columns_.column(field + 3)) bits |= low;
    }
    return bits == 0 ? kTop : static_cast<unsigned>(std::countr_zero(bits));
  }

  Coder& coder_;
  unsigned first_;
  PageColumns& columns_;
  Steps steps_{};
};

/// The columns of a page before version 4, in the order in which they come.
constexpr std::array<PageColumns::Field, PageColumns::kFields> kOldOrder{
    PageColumns::kBytes, PageColumns::kPoints, PageColumns::kForms,       PageColumns::kLowX,
    PageColumns::kLowY,  PageColumns::kLowZ,   PageColumns::kSizeX,       PageColumns::kSizeY,
    PageColumns::kSizeZ, PageColumns::kError,  PageColumns::kDescendants, PageColumns::kChecksum};

/// A page before version 4: each column a base, a shift and a width, then that many bits per
/// cluster. Returns the offset of the first cluster.
std::uint64_t read_old_page(ByteView bytes, PageColumns& columns) {
  struct Packed {
    std::uint64_t base = 0;
    unsigned shift = 0, width = 0;
  };
  ByteReader in(bytes);
  const std::uint64_t offset = in.varint();
  std::vector<Packed> packed(columns.columns());
  std::uint64_t bits = 0;
  for (std::size_t f = 0; f < packed.size(); ++f) {
    const std::uint64_t base = in.varint();
    const bool is_signed = f < kOldOrder.size() && kOldOrder[f] >= PageColumns::kLowX &&
                           kOldOrder[f] <= PageColumns::kLowZ;
    packed[f].base = is_signed ? static_cast<std::uint64_t>(unzigzag(base)) : base;
    packed[f].width = in.get<std::uint8_t>();
    packed[f].shift = in.get<std::uint8_t>();
    if (packed[f].shift > 63 || packed[f].width > 64)
      throw Damage("an index page has a bad column");
    bits += std::uint64_t{packed[f].width} * columns.clusters();
  }
  if (in.left() != (bits + 7) / 8) throw Damage("an index page has a wrong size");
  if (bits % 8 != 0 && bytes.back() >> bits % 8 != 0) {
    throw Damage("an index page ends with bits that are not zero");
  }
  // Readable bytes behind the page, so that a value is one load.
  Bytes room(bytes.begin() + static_cast<std::ptrdiff_t>(in.offset()), bytes.end());
  room.resize(room.size() + 16);
  std::size_t bit = 0;
  for (std::size_t f = 0; f < packed.size(); ++f) {
    const auto [base, shift, width] = packed[f];
    const bool high = f >= kOldOrder.size() && (f - kOldOrder.size()) % 2 != 0;
    const std::size_t field = f < kOldOrder.size() ? std::size_t{kOldOrder[f]} : f;
    for (std::uint64_t& value : columns.column(field)) {
      const unsigned skip = bit & 7;
      std::uint64_t steps = load<std::uint64_t>(room.data() + bit / 8) >> skip;
      if (skip + width > 64) steps |= static_cast<std::uint64_t>(room[bit / 8 + 8]) << (64 - skip);
      if (width < 64) steps &= (std::uint64_t{1} << width) - 1;
      // The last step up may lead beyond the greatest key.
      const bool beyond = high && steps > (UINT64_MAX - base) >> shift;
      value = beyond ? UINT64_MAX : base + (steps << shift);
      bit += width;
    }
  }
  return offset;
}

/// Both ends are exact.
double between(double low, double high, std::uint16_t place) {
  const double share = place / 65535.0;
  return low * (1 - share) + high * share;
}

}  // namespace

Box3 PageBox::in(const Box3& bounds) const {
  Box3 box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = between(bounds.min[axis], bounds.max[axis], low[axis]);
    box.max[axis] = between(bounds.min[axis], bounds.max[axis], high[axis]);
  }
  return box;
}

PageBox PageBox::around(const Box3& box, const Box3& bounds) {
  PageBox found;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = bounds.min[axis], high = bounds.max[axis];
    const auto place = [&](double value) {
      // Halves, so that no difference overflows.
      const double share = (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low) * 65535;
      return static_cast<std::uint16_t>(share > 0 ? std::min(share, 65535.0) : 0);
    };
    // Rounding may have left an end inside.
    std::uint16_t& first = found.low[axis];
    first = place(box.min[axis]);
    while (first > 0 && !(between(low, high, first) <= box.min[axis])) --first;
    std::uint16_t& last = found.high[axis];
    last = place(box.max[axis]);
    while (last < UINT16_MAX && !(between(low, high, last) >= box.max[axis])) ++last;
  }
  return found;
}

PageColumns::PageColumns(std::span<const Entry> entries, std::span<const ScalarType> types,
                         std::span<const KeyRange> ranges)
    : PageColumns(static_cast<std::uint32_t>(entries.size()), types.size()) {
  assert(!entries.empty() && entries.size() <= kMostPageClusters);
  assert(ranges.size() == entries.size() * types.size());
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
    put(kChecksum, entry.checksum);
    for (std::size_t a = 0; a < types.size(); ++a) {
      put(kFields + 2 * a, ranges[i * types.size() + a].low);
      put(kFields + 2 * a + 1, ranges[i * types.size() + a].high);
    }
  }
  for (std::size_t end = 0; end < 2 * types.size(); ++end) {
    const std::span<std::uint64_t> keys = column(kFields + end);
    const ScalarType type = types[end / 2];
    const auto [least, most] = std::minmax_element(keys.begin(), keys.end());
    const bool up = end % 2 != 0;
    const unsigned shift = type == ScalarType::f32 || type == ScalarType::f64
                               ? floating_shift(keys, *least, *most, up)
                               : shift_of(*most - *least, kRangeBits);
    for (std::uint64_t& key : keys) key = widened(key, shift, up);
  }
}

void PageColumns::count(const Layout& layout,
                        std::span<std::array<std::uint32_t, kSymbols>> counts) {
  SymbolCounter counter(counts);
  PageCoder(counter, layout, *this).run();
}

void PageColumns::write(const Layout& layout, const EncodingTables& tables, std::uint64_t offset,
                        Bytes& out) {
  const std::size_t start = out.size();
  put_varint(out, offset);
  SymbolEncoder encoder(tables.tables);
  encoder.start();
  PageCoder(encoder, layout, *this).run();
  encoder.finish(0, out);
  put(out, crc32({out.data() + start, out.size() - start}));
}

PageColumns read_page(ByteView bytes, std::uint32_t clusters, const Layout& layout,
                      const DecodingTables* tables, std::uint64_t& offset) {
  assert(clusters >= 1 && clusters <= layout.page_clusters());
  if (bytes.size() < 4 ||
      crc32(bytes.first(bytes.size() - 4)) != load<std::uint32_t>(&bytes[bytes.size() - 4])) {
    throw Damage("the checksum of an index page is wrong");
  }
  bytes = bytes.first(bytes.size() - 4);
  PageColumns columns(clusters, layout.ranges());
  if (layout.version < 4) {
    offset = read_old_page(bytes, columns);
    return columns;
  }
  ByteReader in(bytes);
  offset = in.varint();
  const ByteView symbols = in.take(in.left());
  Bytes room(kPadding);
  room.insert(room.end(), symbols.begin(), symbols.end());
  room.resize(room.size() + kPadding);
  SymbolDecoder decoder(tables->tables, ByteView(room).subspan(kPadding, symbols.size()));
  PageCoder(decoder, layout, columns).run();
  if (decoder.finish() != 0) throw Damage("an index page does not end as it should");
  return columns;
}

IndexPage::IndexPage(ByteView bytes, std::uint32_t clusters, const Layout& layout,
                     const DecodingTables* tables)
    : clusters_(clusters) {
  const PageColumns columns = read_page(bytes, clusters, layout, tables, offsets_[0]);
  keep(columns);
  for (std::uint32_t i = 0; i < clusters_; ++i) {
    const std::uint64_t cluster = columns.column(Field::kBytes)[i];
    if (cluster >= kMostBytes || offsets_[i] > UINT64_MAX - cluster) {
      throw Damage("an index entry is out of range");
    }
    offsets_[i + 1] = offsets_[i] + cluster;
  }
}

void IndexPage::keep(const PageColumns& columns) {
  columns_.resize(columns.columns());
  std::uint32_t end = 0;
  for (std::size_t f = 0; f < columns_.size(); ++f) {
    const auto values = columns.column(f);
    std::uint64_t differences = 0;
    for (const std::uint64_t value : values) differences |= value ^ values[0];
    Column& column = columns_[f];
    // What all values have in common, above and below the bits in which they differ.
    const auto bits = static_cast<unsigned>(std::bit_width(differences));
    column.shift = static_cast<std::uint8_t>(differences == 0 ? 0 : std::countr_zero(differences));
    column.width = static_cast<std::uint8_t>((bits - column.shift + 7) / 8);
    column.mask = column.width == 8 ? UINT64_MAX : (std::uint64_t{1} << 8 * column.width) - 1;
    column.base = values[0] & ~(column.mask << column.shift);
    column.start = end;
    end += column.width * clusters_;
    bytes_.resize(end + sizeof(std::uint64_t));
    // Each one overwrites what the one before left behind its bytes.
    std::uint8_t* to = bytes_.data() + column.start;
    for (const std::uint64_t value : values) {
      const std::uint64_t kept = value >> column.shift;
      std::memcpy(to, &kept, sizeof kept);
      to += column.width;
    }
  }
}

std::uint64_t IndexPage::value(std::size_t number, std::uint32_t i) const {
  const Column& column = columns_[number];
  const auto kept =
      load<std::uint64_t>(bytes_.data() + column.start + std::size_t{i} * column.width);
  return column.base | (kept & column.mask) << column.shift;
}

KeyRange IndexPage::range(std::uint32_t i, std::size_t attribute) const {
  assert(i < clusters_ && PageColumns::kFields + 2 * attribute < columns_.size());
  const std::size_t low = PageColumns::kFields + 2 * attribute;
  return {value(low, i), value(low + 1, i)};
}

Entry IndexPage::entry(std::uint32_t i) const {
  assert(i < clusters_);
  Entry entry;
  const std::uint64_t bytes = offsets_[i + 1] - offsets_[i], points = value(Field::kPoints, i);
  std::uint64_t forms = value(Field::kForms, i);
  const std::uint64_t error = value(Field::kError, i), checksum = value(Field::kChecksum, i);
  if (points > kMostPoints || error > error_code(std::numeric_limits<double>::infinity()) ||
      checksum > UINT16_MAX) {
    throw Damage("an index entry is out of range");
  }
  entry.bytes = static_cast<std::uint32_t>(bytes);
  entry.points = static_cast<std::uint32_t>(points);
  for (unsigned axis = 3; axis-- > 0; forms /= kNumberForms) {
    entry.forms[axis] = static_cast<NumberForm>(forms % kNumberForms);
    entry.low[axis] = static_cast<std::int64_t>(value(Field::kLowX + axis, i));
    entry.size[axis] = value(Field::kSizeX + axis, i);
    if (entry.size[axis] == 0) throw Damage("an index entry has an empty box");
  }
  if (forms != 0) throw Damage("an index entry has an unknown number form");
  entry.error = static_cast<std::uint16_t>(error);
  entry.descendants = value(Field::kDescendants, i);
  entry.checksum = static_cast<std::uint16_t>(checksum);
  return entry;
}

}  // namespace terrace::stream::store
