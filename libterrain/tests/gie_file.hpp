// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

/// The files in which PROJ keeps what its operations must give (.gie): operations, each with places
/// to convert and what is expected of them.

namespace terrace::terrain::gie {

/// One conversion of an operation, in the units of the file: degrees and metres.
struct GieCase {
  int line = 0;
  bool inverse = false;
  double tolerance = 5e-4;  ///< metres
  std::vector<double> accept;
  std::vector<double> expect;  ///< empty: a round trip, or a failure
  bool failure = false;        ///< nothing but a failure is right
  int round_trips = 0;         ///< so many times there and back; 0: once there
};

struct GieOperation {
  int line = 0;
  std::string text;  ///< without the marks of continued lines
  std::vector<GieCase> cases;
  bool refused = false;  ///< the operation itself is expected to fail
};

/// All operations of a file, in its order; nothing if it cannot be opened.
/// Throws: std::runtime_error for a line that is not understood.
std::optional<std::vector<GieOperation>> read_gie(const std::string& path);

/// A number as these files and PROJ's parameters write it: 2_000.5, 44d11'N, -80d32'30.0. Nothing
/// if it is none.
std::optional<double> gie_number(const std::string& text);

}  // namespace terrace::terrain::gie
