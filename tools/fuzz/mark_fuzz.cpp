// SPDX-License-Identifier: GPL-3.0-or-later
// What --force looks at in a file that stands where it is to write: any bytes, and whether terrace
// wrote them as far as they tell.
#include "cli/output.hpp"
#include "fuzz_target.hpp"

namespace terrace::terrain::fuzz {

using namespace tools;

bool accepts(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = text_of(data, size);
  const MemoryFile file(text);
  const bool ours = written_by_terrace(file.name());
  // Every mark has the name in it.
  require(!ours || text.empty() || text.find("terrace") != std::string_view::npos, "a mark");
  return ours;
}

}  // namespace terrace::terrain::fuzz
