// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Constants of glTF 2.0 (ISO/IEC 12113) and of its binary form, GLB: a header of 12 bytes (magic,
/// version, total bytes), then two chunks, JSON and binary, each with a header (bytes, kind).

namespace terrace::stream::glb {

inline constexpr std::uint32_t kMagic = 0x46546C67;  ///< "glTF"
inline constexpr std::uint32_t kVersion = 2;
inline constexpr std::uint32_t kJson = 0x4E4F534A;    ///< "JSON"
inline constexpr std::uint32_t kBinary = 0x004E4942;  ///< "BIN"
inline constexpr std::uint64_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

// componentType
inline constexpr std::uint64_t kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125,
                               kFloat = 5126;
// mode
inline constexpr std::uint64_t kPoints = 0, kTriangles = 4, kStrip = 5, kFan = 6;
// target
inline constexpr std::uint64_t kArrayBuffer = 34962, kElementArrayBuffer = 34963;

}  // namespace terrace::stream::glb
