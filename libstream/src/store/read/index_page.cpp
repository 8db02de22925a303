// SPDX-License-Identifier: Apache-2.0
#include "store/read/index_page.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace terrace::stream::store {
namespace {

/// Signed values as unsigned ones of the same order.
constexpr std::uint64_t kSignBit = std::uint64_t{1} << 63;

/// Bits of the ends of ranges: a page's clusters lie together, and so do their values.
constexpr unsigned kRangeBits = 5;
/// Of floating point: keys are as far apart from 0 to 1 as from 1 to 1e300.
constexpr std::array<unsigned, 4> kFloatingRangeBits{kRangeBits, 8, 11, 14};

unsigned shift_of(std::uint64_t reach, unsigned bits) {
  const auto width = static_cast<unsigned>(std::bit_width(reach));
  return width > bits ? width - bits : 0;
}

/// How far the ends of ranges of doubles move at this shift, summed up.
double widening(std::span<const std::uint64_t> keys, std::uint64_t least, unsigned shift, bool up) {
  double sum = 0;
  for (const std::uint64_t key : keys) {
    const std::uint64_t above = key - least, down = above >> shift << shift;
    const std::uint64_t moved =
        up && down != above ? least + down + (std::uint64_t{1} << shift) : least + down;
    sum += std::abs(double_of_key(moved) - double_of_key(key));
  }
  return sum;
}

/// The shift for the ends of ranges of doubles: the mean one moves by a 32nd of their reach at most
/// where so many bits are enough.
unsigned floating_shift(std::span<const std::uint64_t> keys, std::uint64_t least,
                        std::uint64_t most, bool up) {
  const double reach = double_of_key(most) - double_of_key(least);
  unsigned shift = 0;
  for (const unsigned bits : kFloatingRangeBits) {
    shift = shift_of(most - least, bits);
    if (widening(keys, least, shift, up) <= reach / 32 * static_cast<double>(keys.size())) break;
  }
  return shift;
}

/// Readable bytes behind the page, so that a value is one load.
constexpr std::size_t kSlack = 16;

}  // namespace

std::array<std::uint64_t, IndexPage::kFields> IndexPage::fields_of(const Entry& entry) {
  std::array<std::uint64_t, kFields> fields{};
  fields[kBytes] = entry.bytes;
  fields[kPoints] = entry.points;
  fields[kForms] = (entry.forms[0] * kNumberForms + entry.forms[1]) * kNumberForms + entry.forms[2];
  for (unsigned axis = 0; axis < 3; ++axis) {
    fields[kLowX + axis] = static_cast<std::uint64_t>(entry.low[axis]) ^ kSignBit;
    fields[kSizeX + axis] = entry.size[axis];
  }
  fields[kError] = entry.error;
  fields[kDescendants] = entry.descendants;
  fields[kChecksum] = entry.checksum;
  return fields;
}

void write_page(std::span<const Entry> entries, std::span<const ScalarType> types,
                std::span<const KeyRange> ranges, std::uint64_t offset, Bytes& out) {
  assert(!entries.empty() && entries.size() <= kPageClusters);
  assert(ranges.size() == entries.size() * types.size());
  const std::size_t n = entries.size(), attributes = types.size();
  // Column after column.
  std::vector<std::uint64_t> values((IndexPage::kFields + 2 * attributes) * n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto fields = IndexPage::fields_of(entries[i]);
    for (std::size_t f = 0; f < fields.size(); ++f) values[f * n + i] = fields[f];
    for (std::size_t a = 0; a < attributes; ++a) {
      const KeyRange range = ranges[i * attributes + a];
      values[(IndexPage::kFields + 2 * a) * n + i] = range.low;
      values[(IndexPage::kFields + 2 * a + 1) * n + i] = range.high;
    }
  }

  const std::size_t start = out.size();
  put_varint(out, offset);
  std::vector<IndexPage::Column> columns(IndexPage::kFields + 2 * attributes);
  for (std::size_t f = 0; f < columns.size(); ++f) {
    IndexPage::Column& column = columns[f];
    const std::span<std::uint64_t> row = std::span(values).subspan(f * n, n);
    const std::uint64_t least =
        f == IndexPage::kChecksum ? 0 : *std::min_element(row.begin(), row.end());
    const std::uint64_t most = *std::max_element(row.begin(), row.end());
    std::uint64_t differences = 0;
    for (const std::uint64_t value : row) differences |= value - row[0];
    column.base = least;
    column.shift = differences == 0 ? 0 : static_cast<std::uint8_t>(std::countr_zero(differences));
    bool up = false;
    if (f >= IndexPage::kFields) {
      // Ranges are widened: low ends go down, high ones up.
      up = (f - IndexPage::kFields) % 2 != 0;
      const ScalarType type = types[(f - IndexPage::kFields) / 2];
      const unsigned shift = type == ScalarType::f32 || type == ScalarType::f64
                                 ? floating_shift(row, least, most, up)
                                 : shift_of(most - least, kRangeBits);
      column.shift = std::max(column.shift, static_cast<std::uint8_t>(shift));
    }
    // A checksum is noise: all of its bits, always.
    if (f == IndexPage::kChecksum) column.shift = 0;
    std::uint64_t last = f == IndexPage::kChecksum ? UINT16_MAX : 0;
    for (std::uint64_t& value : row) {
      const std::uint64_t above = value - least, steps = above >> column.shift;
      value = steps + (up && steps << column.shift != above ? 1 : 0);
      last = std::max(last, value);
    }
    column.width = static_cast<std::uint8_t>(std::bit_width(last));
    // Heights and columns may be negative: a zigzag about the middle keeps bases short.
    const bool is_signed = f >= IndexPage::kLowX && f <= IndexPage::kLowZ;
    put_varint(out, is_signed ? zigzag(static_cast<std::int64_t>(least ^ kSignBit)) : least);
    put(out, static_cast<std::uint16_t>(column.shift << 8 | column.width));
  }
  std::uint64_t hold = 0;
  unsigned held = 0;
  const auto put_bits = [&](std::uint64_t value, unsigned bits) {
    hold |= value << held;
    held += bits;
    for (; held >= 8; held -= 8, hold >>= 8) out.push_back(static_cast<std::uint8_t>(hold));
  };
  for (std::size_t f = 0; f < columns.size(); ++f) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t value = values[f * n + i];
      const unsigned low = std::min<unsigned>(columns[f].width, 32);
      put_bits(value & ((std::uint64_t{1} << low) - 1), low);
      if (columns[f].width > 32) put_bits(value >> 32, columns[f].width - 32u);
    }
  }
  if (held > 0) out.push_back(static_cast<std::uint8_t>(hold));
  put(out, crc32({out.data() + start, out.size() - start}));
}

IndexPage::IndexPage(Bytes bytes, std::uint32_t clusters, std::size_t attributes)
    : bytes_(std::move(bytes)), clusters_(clusters), columns_(kFields + 2 * attributes) {
  assert(clusters >= 1 && clusters <= kPageClusters);
  const std::size_t size = bytes_.size();
  if (size < 4 ||
      crc32({bytes_.data(), size - 4}) != load<std::uint32_t>(bytes_.data() + size - 4)) {
    throw Damage("the checksum of an index page is wrong");
  }
  ByteReader in({bytes_.data(), size - 4});
  offsets_[0] = in.varint();
  std::uint64_t bits = 0;
  for (std::size_t f = 0; f < columns_.size(); ++f) {
    Column& column = columns_[f];
    const std::uint64_t base = in.varint();
    const bool is_signed = f >= kLowX && f <= kLowZ;
    column.base = is_signed ? static_cast<std::uint64_t>(unzigzag(base)) ^ kSignBit : base;
    const auto packed = in.get<std::uint16_t>();
    column.shift = static_cast<std::uint8_t>(packed >> 8);
    column.width = static_cast<std::uint8_t>(packed);
    if (column.shift > 63 || column.width > 64) throw Damage("an index page has a bad column");
    column.start = static_cast<std::uint32_t>(bits);
    bits += std::uint64_t{column.width} * clusters_;
  }
  if (in.left() != (bits + 7) / 8) throw Damage("an index page has a wrong size");
  if (bits % 8 != 0 && bytes_[size - 5] >> bits % 8 != 0) {
    throw Damage("an index page ends with bits that are not zero");
  }
  for (Column& column : columns_) column.start += static_cast<std::uint32_t>(in.offset() * 8);
  bytes_.resize(size + kSlack);
  for (std::uint32_t i = 0; i < clusters_; ++i) {
    const std::uint64_t cluster = value(kBytes, i);
    if (cluster >= kMostBytes || offsets_[i] > UINT64_MAX - cluster) {
      throw Damage("an index entry is out of range");
    }
    offsets_[i + 1] = offsets_[i] + cluster;
  }
}

std::uint64_t IndexPage::steps(std::size_t number, std::uint32_t i) const {
  const Column& column = columns_[number];
  const std::size_t bit = column.start + std::size_t{i} * column.width;
  const unsigned skip = bit & 7;
  std::uint64_t raw = load<std::uint64_t>(bytes_.data() + bit / 8) >> skip;
  if (skip + column.width > 64) {
    raw |= static_cast<std::uint64_t>(bytes_[bit / 8 + 8]) << (64 - skip);
  }
  if (column.width < 64) raw &= (std::uint64_t{1} << column.width) - 1;
  return raw;
}

std::uint64_t IndexPage::value(std::size_t number, std::uint32_t i) const {
  return columns_[number].base + (steps(number, i) << columns_[number].shift);
}

KeyRange IndexPage::range(std::uint32_t i, std::size_t attribute) const {
  assert(i < clusters_ && kFields + 2 * attribute < columns_.size());
  const std::size_t low = kFields + 2 * attribute;
  const Column& high = columns_[low + 1];
  // The last step up may lead beyond the greatest key.
  const bool beyond = steps(low + 1, i) > (UINT64_MAX - high.base) >> high.shift;
  return {value(low, i), beyond ? UINT64_MAX : value(low + 1, i)};
}

Entry IndexPage::entry(std::uint32_t i) const {
  assert(i < clusters_);
  Entry entry;
  const std::uint64_t bytes = offsets_[i + 1] - offsets_[i], points = value(kPoints, i);
  std::uint64_t forms = value(kForms, i);
  const std::uint64_t error = value(kError, i), checksum = value(kChecksum, i);
  if (points > kMostPoints || error > error_code(std::numeric_limits<double>::infinity()) ||
      checksum > UINT16_MAX) {
    throw Damage("an index entry is out of range");
  }
  entry.bytes = static_cast<std::uint32_t>(bytes);
  entry.points = static_cast<std::uint32_t>(points);
  for (unsigned axis = 3; axis-- > 0; forms /= kNumberForms) {
    entry.forms[axis] = static_cast<NumberForm>(forms % kNumberForms);
    entry.low[axis] = static_cast<std::int64_t>(value(kLowX + axis, i) ^ kSignBit);
    entry.size[axis] = value(kSizeX + axis, i);
    if (entry.size[axis] == 0) throw Damage("an index entry has an empty box");
  }
  if (forms != 0) throw Damage("an index entry has an unknown number form");
  entry.error = static_cast<std::uint16_t>(error);
  entry.descendants = value(kDescendants, i);
  entry.checksum = static_cast<std::uint16_t>(checksum);
  return entry;
}

}  // namespace terrace::stream::store
