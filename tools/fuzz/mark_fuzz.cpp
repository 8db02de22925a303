// SPDX-License-Identifier: GPL-3.0-or-later
// The check by --force of an existing output: whether terrace wrote a file with these bytes.
#include "cli/output.hpp"
#include "fuzz_target.hpp"

namespace terrace::terrain::fuzz {

using namespace tools;

bool accepts(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = text_of(data, size);
  const MemoryFile file(text);
  const bool ours = written_by_terrace(file.name());
  // Every mark contains the name.
  require(!ours || text.empty() || text.find("terrace") != std::string_view::npos, "no mark");
  return ours;
}

}  // namespace terrace::terrain::fuzz
