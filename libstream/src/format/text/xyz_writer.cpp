// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>

#include "format/plain_point_writer.hpp"
#include "format/writers.hpp"
#include "io/number.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

/// Returns `name` as a field of a CSV header (RFC 4180).
std::string csv_field(const std::string& name) {
  if (name.find_first_of(",;\"") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) {
    // Readers differ on doubled quotes and on separators inside quotes: use neither.
    out += c == '"' || c == ',' || c == ';' ? '_' : c;
  }
  return out + "\"";
}

/// Returns the unit as the reader finds it in a header; empty for words that are not units of
/// length.
std::string unit_in_brackets(const std::string& unit) {
  const std::string name = canonical_unit(unit);
  if (!is_length_unit(name)) return {};
  if (name == "metre") return " (m)";
  if (name == "foot") return " (ft)";
  return " (" + (name == "US survey foot" ? "ftUS" : name) + ")";
}

/// Returns the names of the columns of coordinates. Units are left out if all are metres, which
/// readers assume.
std::string coordinate_names(const CoordinateUnits& units) {
  std::string horizontal = unit_in_brackets(units.horizontal);
  if (horizontal == " (m)") horizontal.clear();
  std::string height = unit_in_brackets(units.height);
  // Otherwise readers would take the unit of x and y for heights too.
  if (height == " (m)" && horizontal.empty()) height.clear();
  return 'x' + horizontal + ",y" + horizontal + ",z" + height;
}

/// Writes a coordinate. On a lattice with decimal steps (LAS) it is a rounded k * scale + offset,
/// such as 849393.9500000001 where 849393.95 is meant, so it is written with the lattice's
/// decimals.
class CoordinateText {
 public:
  CoordinateText() = default;
  CoordinateText(double scale, double offset) : offset_(offset), decimals_(0) {
    double power = 1.0;
    const auto is_whole = [&](double value) {
      const double scaled = value * power;
      return std::abs(scaled - std::round(scaled)) <= 0x1p-50 * std::abs(scaled);
    };
    for (; decimals_ <= kMaxDecimals && !(is_whole(scale) && is_whole(offset)); ++decimals_) {
      power *= 10.0;
    }
  }

  void append(std::string& text, double value) const {
    const std::size_t begin = text.size();
    append_number(text, value);
    if (text.size() - begin < kLongText || decimals_ > kMaxDecimals) return;
    char digits[kMaxNumber];
    auto [end, error] =
        std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals_);
    double decimal_value = 0.0;
    if (error != std::errc{} || parse_real(digits, end, decimal_value) != end) return;
    while (decimals_ > 0 && end[-1] == '0') --end;
    if (end[-1] == '.') --end;
    // Equal except for the rounding of the product and the sum.
    const bool same =
        std::abs(value - decimal_value) <= 0x1p-51 * (std::abs(value) + std::abs(offset_));
    if (same && static_cast<std::size_t>(end - digits) < text.size() - begin) {
      text.replace(begin, std::string::npos, std::string_view(digits, end));
    }
  }

 private:
  static constexpr int kMaxDecimals = 9;
  static constexpr std::size_t kLongText = 15;  // shorter texts show no rounding

  double offset_ = 0.0;
  int decimals_ = kMaxDecimals + 1;  ///< of the lattice; above kMaxDecimals: not decimal
};

/// Writes points as lines of text: XYZ without a header, CSV with one.
class XyzWriter final : public PlainPointWriter {
 public:
  XyzWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
            char separator)
      : PlainPointWriter(path, header, options), separator_(separator) {
    for (std::size_t axis = 0; header.lattice && axis < 3; ++axis) {
      coordinates_[axis] = {header.lattice->scale[axis], header.lattice->offset[axis]};
    }
  }

  void write_header(const CoordinateUnits& units) {
    names_height_unit_ = true;
    std::string text = coordinate_names(units);
    for (std::size_t i = 0; i < columns().size(); ++i) {
      text += ',';
      text += csv_field(columns().name(i));
    }
    text += '\n';
    sink().write(text);
  }

  [[nodiscard]] bool names_height_unit() const override { return names_height_unit_; }

 private:
  void put(const PointBlock& block, std::string& out) const override {
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Point3& p = block.positions[i];
      coordinates_[0].append(out, p[0]);
      out += separator_;
      coordinates_[1].append(out, p[1]);
      out += separator_;
      coordinates_[2].append(out, p[2]);
      if (columns().size() != 0) columns().append_text(out, block, i, separator_);
      out += '\n';
    }
  }

  char separator_;
  bool names_height_unit_ = false;
  std::array<CoordinateText, 3> coordinates_;
};

}  // namespace

std::unique_ptr<PointWriter> open_xyz_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<XyzWriter>(path, header, options, ' ');
}

std::unique_ptr<PointWriter> open_csv_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  auto writer = std::make_unique<XyzWriter>(path, header, options, ',');
  writer->write_header(header.units ? header.units() : CoordinateUnits());
  return writer;
}

}  // namespace terrace::stream
