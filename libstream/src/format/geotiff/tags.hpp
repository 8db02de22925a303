// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

// Tag numbers of OGC 19-008r4 (GeoTIFF 1.1) and of GDAL's private fields.
namespace terrace::stream {

inline constexpr std::uint32_t kModelPixelScale = 33550;
inline constexpr std::uint32_t kModelTiepoint = 33922;
inline constexpr std::uint32_t kModelTransformation = 34264;
inline constexpr std::uint32_t kGeoKeyDirectory = 34735;
inline constexpr std::uint32_t kGeoDoubleParams = 34736;
inline constexpr std::uint32_t kGeoAsciiParams = 34737;
inline constexpr std::uint32_t kGdalMetadata = 42112;
inline constexpr std::uint32_t kGdalNodata = 42113;

// Keys of the GeoKeyDirectory.
inline constexpr std::uint16_t kGTModelType = 1024;
inline constexpr std::uint16_t kGTRasterType = 1025;
inline constexpr std::uint16_t kGTCitation = 1026;
inline constexpr std::uint16_t kGeodeticCrs = 2048;
inline constexpr std::uint16_t kGeodeticCitation = 2049;
inline constexpr std::uint16_t kAngularUnit = 2054;
inline constexpr std::uint16_t kProjectedCrs = 3072;
inline constexpr std::uint16_t kProjectedCitation = 3073;
inline constexpr std::uint16_t kLinearUnit = 3076;
inline constexpr std::uint16_t kVerticalCrs = 4096;
inline constexpr std::uint16_t kVerticalUnit = 4099;

// Values of keys.
inline constexpr std::uint16_t kModelProjected = 1;
inline constexpr std::uint16_t kModelGeographic = 2;
inline constexpr std::uint16_t kModelGeocentric = 3;
inline constexpr std::uint16_t kPixelIsArea = 1;
inline constexpr std::uint16_t kPixelIsPoint = 2;
inline constexpr std::uint16_t kUserDefined = 32767;

}  // namespace terrace::stream
