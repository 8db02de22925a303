// SPDX-License-Identifier: Apache-2.0
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "format/plain_point_writer.hpp"
#include "format/ply/header.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "io/number.hpp"

namespace terrace::stream {
namespace {

/// Digits of the largest count, for which the header has room.
constexpr std::size_t kCountWidth = 20;

/// Returns `count`, padded with blanks to that width.
std::string count_field(std::uint64_t count) {
  std::string text = fmt::format("{}", count);
  text.resize(kCountWidth, ' ');
  return text;
}

/// Writes points as PLY. finish() writes their number into the header.
class PlyWriter final : public PlainPointWriter {
 public:
  PlyWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
            bool ascii)
      : PlainPointWriter(path, header, options), ascii_(ascii) {
    std::string text = ply_preamble(ascii, header.comments) + "element vertex ";
    count_at_ = text.size();
    text += count_field(0);
    text += "\nproperty double x\nproperty double y\nproperty double z\n";
    for (std::size_t i = 0; i < columns().size(); ++i) {
      text += fmt::format("property {} {}\n", ply_type_name(columns().type(i)), columns().name(i));
    }
    text += "end_header\n";
    sink().write(text);
  }

  void finish() override {
    sink().write_at(count_at_, count_field(points()));
    PlainPointWriter::finish();
  }

 private:
  void put(const PointBlock& block, std::string& out) const override {
    if (ascii_) {
      put_lines(block, out);
    } else {
      put_rows(block, out);
    }
  }
  void put_lines(const PointBlock& block, std::string& out) const {
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Point3& p = block.positions[i];
      append_number(out, p[0]);
      out += ' ';
      append_number(out, p[1]);
      out += ' ';
      append_number(out, p[2]);
      columns().append_text(out, block, i, ' ');
      out += '\n';
    }
  }
  void put_rows(const PointBlock& block, std::string& out) const {
    out.resize(block.size() * (sizeof(Point3) + columns().written_bytes()));
    char* at = out.data();
    for (std::size_t i = 0; i < block.size(); ++i) {
      for (const double value : block.positions[i]) at = store_little_endian(at, value);
      at = columns().put_bytes(at, block, i);
    }
  }

  bool ascii_;
  std::uint64_t count_at_ = 0;
};

}  // namespace

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
