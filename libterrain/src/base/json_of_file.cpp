// SPDX-License-Identifier: Apache-2.0
#include "base/json_of_file.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/core.h>

#include "base/units.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

/// Iterates over a text and throws stream::Stopped once a stop is requested.
class StoppableText {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  StoppableText(const char* at, const std::stop_token& stop) : at_(at), stop_(&stop) {}
  reference operator*() const { return *at_; }
  StoppableText& operator++() {
    constexpr std::uintptr_t kBetweenChecks = 0x10000;
    if (reinterpret_cast<std::uintptr_t>(++at_) % kBetweenChecks == 0 && stop_->stop_requested()) {
      throw stream::Stopped();
    }
    return *this;
  }
  StoppableText operator++(int) {
    StoppableText before = *this;
    ++*this;
    return before;
  }
  bool operator==(const StoppableText& other) const { return at_ == other.at_; }
  bool operator!=(const StoppableText& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const std::stop_token* stop_;
};

std::string place_of(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, byte);
  const std::size_t line_begin = before.rfind('\n') + 1;  // 0 if there is none
  return fmt::format("line {}, column {}", 1 + std::count(before.begin(), before.end(), '\n'),
                     before.size() - line_begin + 1);
}

}  // namespace

std::optional<nlohmann::json> json_of_file(const std::string& name, std::uint64_t max_bytes,
                                           const stream::Message& remedy,
                                           const std::stop_token& stop) {
  // An ifstream opens a folder, then throws at the first read.
  std::error_code ignored;
  if (std::filesystem::is_directory(name, ignored)) return std::nullopt;
  std::ifstream file(name, std::ios::binary);
  if (!file) return std::nullopt;
  const auto fault = [&](std::string cause) {
    return stream::Error(name, std::move(cause)).remedy(remedy);
  };
  std::string text;
  std::vector<char> piece(std::size_t{1} << 16);
  while (file) {
    if (stop.stop_requested()) throw stream::Stopped();
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > max_bytes) {
      throw fault(fmt::format("is larger than the {} that such a file may have",
                              readable_bytes(max_bytes)));
    }
    // Recognises binary files early, before reading them to the end.
    const std::size_t first = text.find_first_not_of("\xEF\xBB\xBF \t\r\n");
    if (first != std::string::npos && text[first] != '{' && text[first] != '[') {
      throw fault("is not JSON");
    }
  }
  if (file.bad()) return std::nullopt;
  try {
    return nlohmann::json::parse(StoppableText(text.data(), stop),
                                 StoppableText(text.data() + text.size(), stop));
  } catch (const nlohmann::json::parse_error& error) {
    const std::size_t byte = std::min(error.byte == 0 ? 0 : error.byte - 1, text.size());
    throw fault(byte == text.size() ? "the JSON is cut off" : "is not JSON")
        .at(place_of(text, byte));
  } catch (const nlohmann::json::out_of_range&) {
    throw fault("has a number that is too large");
  }
  return std::nullopt;
}

std::string convert_to_geojson(const std::string& name) {
  return fmt::format(
      "give GeoJSON; 'ogr2ogr -f GeoJSON -lco RFC7946=YES out.geojson {}' converts what GDAL can "
      "read",
      name);
}

}  // namespace terrace::terrain
