// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// Splits GeoJSON (RFC 7946) into the texts of its features, without parsing them: the features of
/// a FeatureCollection or GeometryCollection, or consecutive objects, as in newline-delimited
/// GeoJSON and GeoJSON text sequences (RFC 8142). Holds one feature at a time.
class GeoJsonItems {
 public:
  /// input: at its first byte; must outlive the object. max_bytes: limit for one feature, and for
  /// the text before and after all of them. wants_crs: false leaves crs() empty. Moves to the first
  /// feature. Throws: Error, Stopped.
  GeoJsonItems(Input& input, std::size_t max_bytes, bool wants_crs);

  /// Returns the text of the next object; nullopt at the end. Valid until the next call. Throws:
  /// Error naming file and byte, Stopped.
  [[nodiscard]] std::optional<std::string_view> next();
  /// Offset in the file of the object last returned by next().
  [[nodiscard]] std::uint64_t offset() const { return input_->offset(); }
  /// Returns the collection's member "crs" (GeoJSON of 2008), otherwise longitude and latitude of
  /// WGS 84. A different member after the features is an error, because it comes too late.
  [[nodiscard]] const Crs& crs() const { return crs_; }
  /// Whether terrace wrote the lines of the collection, each with its number as "line".
  [[nodiscard]] bool numbers_lines() const { return numbers_lines_; }

 private:
  /// Where a scan ended: at the end of an object, or after the bracket that opens its list.
  struct Stop {
    std::size_t at = 0;
    bool in_list = false;
  };

  char at(std::size_t index);
  void skip_white_space();
  void advance();
  void leave_list();
  /// depth: 0 if the object's opening brace is next, 1 if it has been read.
  Stop scan_object(std::size_t depth, bool stop_at_list);
  void take_members(std::string_view text, bool before);
  [[nodiscard]] Error fault(std::string cause, std::size_t ahead = 0) const;

  Input* input_;
  std::size_t max_bytes_;
  bool wants_crs_;
  std::string_view window_;
  std::size_t found_ = 0;  ///< bytes of the object at the start of the window; 0 at the end
  bool numbers_lines_ = false;
  bool started_ = false, in_list_ = false, first_of_list_ = false;
  Crs crs_;
};

}  // namespace terrace::stream
