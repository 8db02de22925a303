// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "terrace/stream/input.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// Cuts GeoJSON (RFC 7946) into the texts of its features, without reading what they hold: those of
/// a FeatureCollection or GeometryCollection, and of objects that follow one another, as in
/// newline-delimited GeoJSON and GeoJSON text sequences (RFC 8142). Holds one feature at a time.
class GeoJsonItems {
 public:
  /// input: at its first byte; must outlive the object. most_bytes: of one feature, and of what
  /// stands before and behind all of them. wants_crs: false leaves crs() empty. Goes to the first
  /// feature. Throws: Error, Stopped.
  GeoJsonItems(Input& input, std::size_t most_bytes, bool wants_crs);

  /// The text of the next object; nothing at the end. Valid until the next call.
  /// Throws: Error naming file and byte, Stopped.
  [[nodiscard]] std::optional<std::string_view> next();
  /// Where the object that next() gave last begins in the file.
  [[nodiscard]] std::uint64_t offset() const { return input_->offset(); }
  /// As the member "crs" of the collection has it (GeoJSON of 2008), else longitude and latitude of
  /// WGS 84. What stands behind the features is too late.
  [[nodiscard]] const Crs& crs() const { return crs_; }

 private:
  /// Where a scan ended: at the end of an object, or of the bracket that opens its list.
  struct Stop {
    std::size_t at = 0;
    bool in_list = false;
  };

  char at(std::size_t place);
  void skip_white_space();
  void advance();
  void leave_list();
  /// depth: 0 if the object's brace is still to come.
  Stop scan_object(std::size_t depth, bool stop_at_list);
  void take_members(std::string_view text, bool before);
  [[noreturn]] void fail(const std::string& cause, std::size_t ahead = 0) const;

  Input* input_;
  std::size_t most_bytes_;
  bool wants_crs_;
  std::string_view window_;
  std::size_t found_ = 0;  ///< bytes of the object at the window's begin; 0 at the end
  bool started_ = false, in_list_ = false, first_of_list_ = false;
  Crs crs_;
};

}  // namespace terrace::stream
