// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "linkage_laws.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

using laws::heights_of;

TEST(CudaLinkage, ReportsWhyItCannotRun) {
  const CudaStatus status = cuda_available();
  if (status.available) {
    EXPECT_FALSE(status.device.empty());
    EXPECT_TRUE(status.reason.empty());
    return;
  }
  EXPECT_TRUE(laws::contains(status.reason, "CUDA")) << status.reason;
  EXPECT_TRUE(laws::contains(status.reason, "cluster on the CPU")) << status.reason;
  const std::vector<Point3> points{{0, 0, 0}, {1, 0, 0}};
  const auto reason_of = [](const auto& action) {
    try {
      (void)action();
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(reason_of([&] { return cuda_complete_linkage(points); }), status.reason);
  EXPECT_EQ(reason_of([&] { return cuda_single_linkage(points); }), status.reason);
}

TEST(CudaLinkage, RefusesPointsThatAreNotFinite) {
  const std::vector<Point3> points{{0, 0, 0}, {1, 0, 0}, {0, std::nan(""), 0}};
  for (const bool complete : {false, true}) {
    try {
      (void)(complete ? cuda_complete_linkage(points) : cuda_single_linkage(points));
      ADD_FAILURE() << "a point that is not finite passed";
    } catch (const std::invalid_argument& error) {
      EXPECT_TRUE(laws::contains(error.what(), "point 2 ")) << error.what();
    }
  }
}

TEST(CudaLinkage, EqualsTheCpu) {
  if (const CudaStatus status = cuda_available(); !status.available) {
    GTEST_SKIP() << status.reason;
  }
  for (const std::size_t count : {0u, 1u, 2u, 3u, 4u, 5u, 32u, 33u, 257u, 1000u, 4097u}) {
    SCOPED_TRACE(testing::Message() << count << " points");
    std::mt19937_64 random(count);
    const std::vector<Point3> points = inputs::cube(count, random);
    EXPECT_EQ(cuda_complete_linkage(points), complete_linkage(points));
    // Distances rounded to float are sometimes equal, so several runs are valid.
    EXPECT_EQ(laws::complete_fault(cuda_complete_linkage(points, MatrixEntry::float32),
                                   laws::distances_of(points), laws::kFloatTolerance),
              "");
    EXPECT_EQ(cuda_single_linkage(points), single_linkage(points));
  }
  for (const auto& [name, points] : laws::linkage_inputs(150, 6)) {
    SCOPED_TRACE(name);
    EXPECT_EQ(
        laws::complete_fault(cuda_complete_linkage(points), laws::distances_of(points), 1e-14), "");
    EXPECT_EQ(heights_of(cuda_single_linkage(points)), heights_of(single_linkage(points)));
    EXPECT_EQ(cuda_complete_linkage(points), cuda_complete_linkage(points));
  }
}

TEST(CudaLinkage, ReportsTheMemoryItNeeds) {
  if (const CudaStatus status = cuda_available(); !status.available) {
    GTEST_SKIP() << status.reason;
  }
  const std::vector<Point3> points(2000000, Point3{});
  try {
    (void)cuda_complete_linkage(points);
    ADD_FAILURE() << "25 TB fit";
  } catch (const std::invalid_argument& error) {
    EXPECT_TRUE(laws::contains(error.what(), "bytes")) << error.what();
  }
}

}  // namespace
}  // namespace terrace::cluster
