// SPDX-License-Identifier: Apache-2.0
// LAZ files by third parties (data/laz_facts.tsv: file, points, FNV-1a of the records as decoded by
// LASzip), if TERRACE_DATA names a folder that has them.
#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "laz_testing.hpp"
#include "raster_testing.hpp"

namespace terrace::stream::laz {
namespace {

struct LazFacts {
  std::string file;
  std::uint64_t points = 0, hash = 0;
};

std::vector<LazFacts> laz_facts() {
  std::ifstream file(TERRACE_TEST_DATA "/laz_facts.tsv");
  std::vector<LazFacts> all;
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream in(line);
    LazFacts f;
    std::getline(in, f.file, '\t');
    in >> f.points >> std::hex >> f.hash;
    all.push_back(f);
  }
  return all;
}

TEST(LazReal, RecordsMatchLaszip) {
  const auto folder = real_data();
  if (!folder) GTEST_SKIP() << "needs TERRACE_DATA";
  const std::vector<LazFacts> facts = laz_facts();
  EXPECT_EQ(facts.size(), 26u);
  for (const LazFacts& f : facts) {
    SCOPED_TRACE(f.file);
    const LazFile file(read_bytes(*folder / "lidar" / f.file));
    EXPECT_EQ(file.points, f.points);
    Decoder decoder(file.vlr);
    Encoder encoder(file.vlr);
    std::uint64_t hash = kFnvStart;
    for (const Chunk& chunk : file.chunks) {
      ByteVector records(chunk.points * file.vlr.record_length());
      decoder.decode_chunk(file.chunk(chunk), records);
      hash = fnv1a(records, hash);
      // Encoding again gives the file's bytes: all were written by LASzip or a faithful port.
      ByteVector again;
      encoder.encode_chunk(records, again);
      EXPECT_TRUE(std::ranges::equal(again, file.chunk(chunk)));
    }
    EXPECT_EQ(hash, f.hash);
    const ByteVector table = write_chunk_table(file.chunks, file.vlr);
    EXPECT_TRUE(std::ranges::equal(table, std::span(file.bytes).subspan(file.table, table.size())));
  }
}

}  // namespace
}  // namespace terrace::stream::laz
