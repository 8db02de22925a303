// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "terrace/stream/byte_source.hpp"

namespace terrace::stream::net {

/// Returns few parts of a file that contain the given ones, in ascending order and disjoint: those
/// that requests are made for. Parts are joined across gaps of at most 256 KiB, the smallest first,
/// as long as all gaps of more than 4 KiB together are at most a quarter of the needed bytes, or 64
/// KiB. Parts of more than 8 MiB are cut. The order of the given parts does not matter, and they
/// may overlap.
std::vector<BytePart> joined_parts(std::vector<BytePart> parts);

}  // namespace terrace::stream::net
