// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {
namespace {

// For the sanitizers: an empty view must not compute addresses.
TEST(Schema, ViewsRecordsThatAreNotThere) {
  Schema schema;
  schema.attributes = {{.name = "a", .type = ScalarType::f64},
                       {.name = "b", .type = ScalarType::u8}};
  EXPECT_EQ(schema.view<std::uint8_t>({}, 1).size(), 0u);
}

}  // namespace
}  // namespace terrace::stream
