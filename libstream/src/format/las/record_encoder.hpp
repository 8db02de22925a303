// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/las/layout.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {

/// Converts points to LAS records, and collects the statistics for the header.
class LasRecords {
 public:
  static constexpr std::size_t kReturns = 15;  ///< counted in the header

  /// Throws: Error naming `path` for attributes that LAS has no room for.
  LasRecords(const std::string& path, const PointHeader& header, LasFormats formats);

  /// The records of a block, valid until the next call. Throws: Error for a coordinate beyond the
  /// lattice's range and a value that its field cannot hold.
  std::string_view pack(const PointBlock& block);

  [[nodiscard]] const LasLayout& layout() const { return layout_; }
  [[nodiscard]] const std::vector<Channel>& attributes() const { return attributes_; }
  /// The lattice of the records; arbitrary before the first point.
  [[nodiscard]] Lattice lattice() const { return lattice_.value_or(Lattice{}); }
  /// Whether the point format is one of LAS before 1.4.
  [[nodiscard]] bool legacy() const { return layout_.point_format < 6; }
  [[nodiscard]] std::uint64_t points() const { return points_; }
  [[nodiscard]] double rounding() const { return rounding_; }
  /// In steps of the lattice; without points least exceeds greatest.
  [[nodiscard]] const std::array<std::int32_t, 3>& least() const { return least_; }
  [[nodiscard]] const std::array<std::int32_t, 3>& most() const { return most_; }
  [[nodiscard]] const std::array<std::uint64_t, kReturns>& returns() const { return returns_; }

 private:
  [[noreturn]] void fail(std::string where, std::string cause, std::string remedy) const;
  void put_coordinate(const PointBlock& block, std::size_t axis);
  void put_attribute(const std::byte* from, std::size_t count, const Channel& channel,
                     const LasField& field);
  template <class Value>
  Value converted(const std::byte* from, const Channel& channel, const LasField& field,
                  double exact, std::uint64_t point) const;
  void set_single_returns();
  void count_returns();

  std::string path_;
  std::vector<Channel> attributes_;
  LasLayout layout_;
  std::optional<Lattice> lattice_;
  std::optional<Box3> bounds_;
  std::size_t payload_bytes_ = 0;
  std::string records_;
  std::uint64_t points_ = 0;
  std::array<std::int32_t, 3> least_{INT32_MAX, INT32_MAX, INT32_MAX},
      most_{INT32_MIN, INT32_MIN, INT32_MIN};
  std::array<std::uint64_t, kReturns> returns_{};
  double rounding_ = 0.0;
};

/// The parts of a file that the header describes besides its points.
struct LasFile {
  bool compressed = false, has_wkt = false;
  std::uint64_t points_offset = 0;
  std::uint32_t vlrs = 0;
  std::uint64_t evlr_offset = 0;
  std::uint32_t evlrs = 0;
};

/// The header of LAS 1.4.
std::string las_header_text(const LasRecords& records, const LasFile& file);

/// Appends a VLR. Requires data of at most 65,535 bytes.
void append_vlr(std::string& out, std::string_view user, std::uint16_t id, std::string_view data);
/// The head of an EVLR with this many bytes of data, which must follow.
std::string evlr_head(std::string_view user, std::uint16_t id, std::uint64_t bytes);
/// Appends the VLRs of a CRS and of extra bytes, and counts them in `file`. Throws: Error naming
/// `path` for WKT that is too long.
void append_vlrs(std::string& out, const Crs& crs, const LasLayout& layout, const std::string& path,
                 LasFile& file);

}  // namespace terrace::stream
