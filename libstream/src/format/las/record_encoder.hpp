// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/las/layout.hpp"
#include "spares.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {

/// The header's summary of the records.
struct LasSums {
  static constexpr std::size_t kReturns = 15;

  std::uint64_t points = 0;
  /// Bounds of the points in steps of the lattice. Without points `lowest` exceeds `highest`.
  std::array<std::int32_t, 3> lowest{INT32_MAX, INT32_MAX, INT32_MAX},
      highest{INT32_MIN, INT32_MIN, INT32_MIN};
  std::array<std::uint64_t, kReturns> returns{};
  double rounding = 0.0;  ///< as PointWriter::rounding()

  void include(const LasSums& other);
};

/// Converts points to LAS records, and collects the sums for the header.
class LasRecords {
 public:
  /// Throws: Error naming `path` if LAS has no room for the attributes.
  LasRecords(const std::string& path, const PointHeader& header, LasFormats formats);
  ~LasRecords();

  /// Encodes a block for take(), as PointWriter::encode() does.
  [[nodiscard]] PointWriter::EncodedPtr encode(const PointBlock& block) const;
  /// Returns the records of the next points and includes them in sums(); valid until the next call.
  /// Throws: Error for a coordinate outside the lattice's range and for a value that does not fit
  /// its field.
  std::string_view take(PointWriter::EncodedPtr points);

  [[nodiscard]] const LasLayout& layout() const { return layout_; }
  [[nodiscard]] const std::vector<Channel>& attributes() const { return attributes_; }
  [[nodiscard]] const Crs& crs() const { return crs_; }
  /// Returns the lattice of the records; arbitrary before the first point.
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  /// True if the point format existed before LAS 1.4.
  [[nodiscard]] bool legacy() const { return layout_.point_format < 6; }
  /// Returns the summary of all records taken so far.
  [[nodiscard]] const LasSums& sums() const { return sums_; }

 private:
  struct Records;

  void pack(const PointBlock& block, Records& out) const;
  void put_coordinate(const PointBlock& block, std::size_t axis, Records& out) const;
  void put_attribute(const std::byte* values, const Channel& channel, const LasField& field,
                     Records& out) const;
  template <class Value>
  Value convert(const std::byte* values, const Channel& channel, const LasField& field,
                double exact, std::uint64_t point) const;
  void set_single_returns(std::string& records) const;
  void count_returns(Records& out) const;

  std::string path_;
  std::vector<Channel> attributes_;
  LasLayout layout_;
  Crs crs_;
  std::optional<Box3> bounds_;
  std::size_t payload_bytes_ = 0;
  std::atomic<bool> has_lattice_;  ///< if false, the first points determine it
  Lattice lattice_;
  LasSums sums_;
  std::unique_ptr<Records> current_;
  mutable Spares<Records> spares_;
};

/// The parts of a file that the header describes besides its points.
struct LasFile {
  bool compressed = false, has_wkt = false;
  std::uint64_t points_offset = 0;
  std::uint32_t vlrs = 0;
  std::uint64_t evlr_offset = 0;
  std::uint32_t evlrs = 0;
};

/// Returns the header of LAS 1.4.
std::string las_header_text(const LasRecords& records, const LasFile& file);

/// Appends a VLR. Requires data of at most 65,535 bytes.
void append_vlr(std::string& out, std::string_view user, std::uint16_t id, std::string_view data);
/// Returns the head of an EVLR with this many bytes of data, which must follow.
std::string evlr_head(std::string_view user, std::uint16_t id, std::uint64_t bytes);
/// Appends the VLRs of a CRS and of extra bytes, and counts them in `file`. Throws: Error naming
/// `path` for WKT that is too long.
void append_vlrs(std::string& out, const Crs& crs, const LasLayout& layout, const std::string& path,
                 LasFile& file);

}  // namespace terrace::stream
