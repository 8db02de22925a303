// SPDX-License-Identifier: Apache-2.0
#include "store/read/index_page.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

namespace terrace::stream::store {
namespace {

/// Signed values as unsigned ones of the same order.
constexpr std::uint64_t kSignBit = std::uint64_t{1} << 63;

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

void write_page(std::span<const Entry> entries, std::uint64_t offset, Bytes& out) {
  assert(!entries.empty() && entries.size() <= kPageClusters);
  std::array<std::array<std::uint64_t, IndexPage::kFields>, kPageClusters> rows;
  for (std::size_t i = 0; i < entries.size(); ++i) rows[i] = IndexPage::fields_of(entries[i]);

  const std::size_t start = out.size();
  put_varint(out, offset);
  std::array<IndexPage::Column, IndexPage::kFields> columns{};
  for (unsigned f = 0; f < IndexPage::kFields; ++f) {
    IndexPage::Column& column = columns[f];
    std::uint64_t least = UINT64_MAX, most = 0, differences = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      least = std::min(least, rows[i][f]);
      most = std::max(most, rows[i][f]);
      differences |= rows[i][f] - rows[0][f];
    }
    // A checksum is noise: all of its bits, always.
    if (f == IndexPage::kChecksum) least = 0, most = UINT16_MAX, differences = 1;
    column.base = least;
    column.shift = differences == 0 ? 0 : static_cast<std::uint8_t>(std::countr_zero(differences));
    column.width = static_cast<std::uint8_t>(std::bit_width((most - least) >> column.shift));
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
  for (unsigned f = 0; f < IndexPage::kFields; ++f) {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const std::uint64_t value = (rows[i][f] - columns[f].base) >> columns[f].shift;
      const unsigned low = std::min<unsigned>(columns[f].width, 32);
      put_bits(value & ((std::uint64_t{1} << low) - 1), low);
      if (columns[f].width > 32) put_bits(value >> 32, columns[f].width - 32u);
    }
  }
  if (held > 0) out.push_back(static_cast<std::uint8_t>(hold));
  put(out, crc32({out.data() + start, out.size() - start}));
}

IndexPage::IndexPage(Bytes bytes, std::uint32_t clusters)
    : bytes_(std::move(bytes)), clusters_(clusters) {
  assert(clusters >= 1 && clusters <= kPageClusters);
  const std::size_t size = bytes_.size();
  if (size < 4 ||
      crc32({bytes_.data(), size - 4}) != load<std::uint32_t>(bytes_.data() + size - 4)) {
    throw Damage("the checksum of an index page is wrong");
  }
  ByteReader in({bytes_.data(), size - 4});
  offsets_[0] = in.varint();
  std::uint64_t bits = 0;
  for (unsigned f = 0; f < kFields; ++f) {
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

std::uint64_t IndexPage::value(Field field, std::uint32_t i) const {
  const Column& column = columns_[field];
  const std::size_t bit = column.start + std::size_t{i} * column.width;
  const unsigned skip = bit & 7;
  std::uint64_t raw = load<std::uint64_t>(bytes_.data() + bit / 8) >> skip;
  if (skip + column.width > 64) {
    raw |= static_cast<std::uint64_t>(bytes_[bit / 8 + 8]) << (64 - skip);
  }
  if (column.width < 64) raw &= (std::uint64_t{1} << column.width) - 1;
  return column.base + (raw << column.shift);
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
    entry.low[axis] =
        static_cast<std::int64_t>(value(static_cast<Field>(kLowX + axis), i) ^ kSignBit);
    entry.size[axis] = value(static_cast<Field>(kSizeX + axis), i);
    if (entry.size[axis] == 0) throw Damage("an index entry has an empty box");
  }
  if (forms != 0) throw Damage("an index entry has an unknown number form");
  entry.error = static_cast<std::uint16_t>(error);
  entry.descendants = value(kDescendants, i);
  entry.checksum = static_cast<std::uint16_t>(checksum);
  return entry;
}

}  // namespace terrace::stream::store
