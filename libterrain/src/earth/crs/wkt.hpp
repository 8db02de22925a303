// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace terrace::terrain {

/// A piece of well-known text: KEYWORD[part, part, ...], "quoted", a number or a bare word.
struct WktNode {
  std::string text;  ///< the keyword in capitals, or the value as it stands
  bool quoted = false;
  std::vector<WktNode> parts;  ///< of a keyword

  /// The first part of one of these keywords; nullptr if there is none.
  [[nodiscard]] const WktNode* find(std::initializer_list<std::string_view> keywords) const;
  /// The quoted first part: the name.
  [[nodiscard]] std::string name() const;
  /// Part i as a number. Throws: CrsError if it is none.
  [[nodiscard]] double number(std::size_t i) const;
  /// The code of AUTHORITY["EPSG","n"] or ID["EPSG",n]; 0 if there is none.
  [[nodiscard]] int epsg() const;
};

/// Throws: CrsError, with the place of the fault.
WktNode parse_wkt(std::string_view text);

/// Lower case, letters and digits only: how names are compared.
std::string plain_name(std::string_view name);

}  // namespace terrace::terrain
