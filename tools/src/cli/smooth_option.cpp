// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/smooth_option.hpp"

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

std::optional<tri::SmoothingOptions> parse_smoothing(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  tri::SmoothingOptions options;
  if (name == "laplacian") {
    options.method = tri::Smoothing::kLaplacian;
  } else if (name == "taubin") {
    options.method = tri::Smoothing::kTaubin;
  } else if (name == "bilateral") {
    options.method = tri::Smoothing::kBilateral;
  } else {
    throw UsageError(
        "--smooth is laplacian, taubin or bilateral, with :STEPS behind if wanted, not '" + text +
        "'");
  }
  if (colon != std::string::npos) {
    const std::uint64_t steps = parse_count(text.substr(colon + 1));
    if (steps == 0 || steps > 10000) throw UsageError("--smooth takes 1 to 10000 steps");
    options.iterations = static_cast<unsigned>(steps);
  }
  return options;
}

}  // namespace terrace::tools
