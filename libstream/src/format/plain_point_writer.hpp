// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "format/output_columns.hpp"
#include "spares.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {

/// Writes a file in which the bytes of each point follow those of the point before it.
class PlainPointWriter : public PointWriter {
 public:
  PlainPointWriter(const std::string& path, const PointHeader& header, const WriterOptions& options)
      : sink_(path, options.replace, options.stop), columns_(header.attributes) {}

  [[nodiscard]] EncodedPtr encode(const PointBlock& block) const final {
    columns_.assert_matches(block);
    auto encoded = spares_.take();
    encoded->bytes.clear();
    put(block, encoded->bytes);
    encoded->points = block.size();
    return encoded;
  }
  void append(EncodedPtr points) final {
    std::unique_ptr<Bytes> encoded(static_cast<Bytes*>(points.release()));
    sink_.write(encoded->bytes);
    points_ += encoded->points;
    spares_.put(std::move(encoded));
  }
  void finish() override { sink_.commit(); }
  [[nodiscard]] std::uint64_t points() const final { return points_; }

 protected:
  /// Appends the bytes of the points.
  virtual void put(const PointBlock& block, std::string& out) const = 0;

  [[nodiscard]] Sink& sink() { return sink_; }
  [[nodiscard]] const OutputColumns& columns() const { return columns_; }

 private:
  struct Bytes final : Encoded {
    std::string bytes;
    std::uint64_t points = 0;
  };

  Sink sink_;
  OutputColumns columns_;
  mutable Spares<Bytes> spares_;
  std::uint64_t points_ = 0;
};

}  // namespace terrace::stream
