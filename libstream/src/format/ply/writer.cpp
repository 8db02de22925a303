// SPDX-License-Identifier: Apache-2.0
#include "format/ply/writer.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "format/output_columns.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "io/number.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kPieceBytes = 64u << 10;
/// Digits of the largest count: the place in the header that is kept for it.
constexpr std::size_t kCountWidth = 20;

/// A count and the blanks that fill its place.
std::string count_field(std::uint64_t count) {
  std::string text = std::to_string(count);
  text.resize(kCountWidth, ' ');
  return text;
}

class PlyWriter final : public PointWriter {
 public:
  PlyWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
            bool ascii)
      : sink_(path, options.replace, options.stop), columns_(header.attributes), ascii_(ascii) {
    std::string text = ply_preamble(ascii, header.comments) + "element vertex ";
    count_at_ = text.size();
    text += count_field(0);
    text += "\nproperty double x\nproperty double y\nproperty double z\n";
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      text += "property " + ply_type_name(columns_.type(i)) + " " + columns_.name(i) + "\n";
    }
    text += "end_header\n";
    sink_.write(text);
  }

  void append(const PointBlock& block) override {
    columns_.check(block);
    if (ascii_) {
      append_lines(block);
    } else {
      append_rows(block);
    }
    points_ += block.size();
  }

  void finish() override {
    sink_.write_at(count_at_, count_field(points_));
    sink_.commit();
  }

  std::uint64_t points() const override { return points_; }

 private:
  void append_lines(const PointBlock& block) {
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Point3& p = block.positions[i];
      append_number(piece_, p[0]);
      piece_ += ' ';
      append_number(piece_, p[1]);
      piece_ += ' ';
      append_number(piece_, p[2]);
      columns_.append_text(piece_, block, i, ' ');
      piece_ += '\n';
      if (piece_.size() >= kPieceBytes) flush();
    }
    flush();
  }
  void append_rows(const PointBlock& block) {
    const std::size_t row = sizeof(Point3) + columns_.written_bytes(), rows = kPieceBytes / row + 1;
    for (std::size_t i = 0; i < block.size();) {
      const std::size_t end = std::min(block.size(), i + rows);
      piece_.resize((end - i) * row);
      for (char* at = piece_.data(); i < end; ++i) {
        for (const double value : block.positions[i]) at = store_little_endian(at, value);
        at = columns_.put_bytes(at, block, i);
      }
      sink_.write(piece_);
    }
    piece_.clear();
  }
  void flush() {
    sink_.write(piece_);
    piece_.clear();
  }

  Sink sink_;
  OutputColumns columns_;
  bool ascii_;
  std::uint64_t count_at_ = 0, points_ = 0;
  std::string piece_;
};

}  // namespace

std::string ply_type_name(ScalarType type) {
  switch (type) {
    case ScalarType::i8:
      return "char";
    case ScalarType::u8:
      return "uchar";
    case ScalarType::i16:
      return "short";
    case ScalarType::u16:
      return "ushort";
    case ScalarType::i32:
      return "int";
    case ScalarType::u32:
      return "uint";
    case ScalarType::f32:
      return "float";
    case ScalarType::f64:
      return "double";
    case ScalarType::i64:
    case ScalarType::u64:
      break;
  }
  return std::string(name_of(type));
}

std::string ply_preamble(bool ascii, std::span<const std::string> comments) {
  std::string text = "ply\nformat ";
  text += ascii ? "ascii 1.0\n" : "binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    text += "comment ";
    for (const char c : comment) text += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    text += '\n';
  }
  return text;
}

std::unique_ptr<PointWriter> open_ply_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<PlyWriter>(path, header, options, /*ascii=*/false);
}

std::unique_ptr<PointWriter> open_ply_ascii_writer(const std::string& path,
                                                   const PointHeader& header,
                                                   const WriterOptions& options) {
  return std::make_unique<PlyWriter>(path, header, options, /*ascii=*/true);
}

}  // namespace terrace::stream
