// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include "format/output_columns.hpp"
#include "format/writers.hpp"
#include "io/number.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kTextBytes = 64u << 10;

/// A name as a field of a CSV header (RFC 4180).
std::string csv_field(const std::string& name) {
  if (name.find_first_of(",;\"") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) {
    // Readers differ on doubled quotes and on separators inside quotes: use neither.
    out += c == '"' || c == ',' || c == ';' ? '_' : c;
  }
  return out + "\"";
}

class XyzWriter final : public PointWriter {
 public:
  XyzWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
            char separator)
      : sink_(path, options.replace, options.stop),
        columns_(header.attributes),
        separator_(separator) {}

  void write_header() {
    text_ = "x,y,z";
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      text_ += ',';
      text_ += csv_field(columns_.name(i));
    }
    text_ += '\n';
    sink_.write(text_);
    text_.clear();
  }

  void append(const PointBlock& block) override {
    columns_.check(block);
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Point3& p = block.positions[i];
      append_number(text_, p[0]);
      text_ += separator_;
      append_number(text_, p[1]);
      text_ += separator_;
      append_number(text_, p[2]);
      if (columns_.size() != 0) columns_.append_text(text_, block, i, separator_);
      text_ += '\n';
      if (text_.size() >= kTextBytes) flush();
    }
    flush();
    points_ += block.size();
  }

  void finish() override { sink_.commit(); }

  std::uint64_t points() const override { return points_; }

 private:
  void flush() {
    sink_.write(text_);
    text_.clear();
  }

  Sink sink_;
  OutputColumns columns_;
  char separator_;
  std::string text_;
  std::uint64_t points_ = 0;
};

}  // namespace

std::unique_ptr<PointWriter> open_xyz_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<XyzWriter>(path, header, options, ' ');
}

std::unique_ptr<PointWriter> open_csv_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  auto writer = std::make_unique<XyzWriter>(path, header, options, ',');
  writer->write_header();
  return writer;
}

}  // namespace terrace::stream
