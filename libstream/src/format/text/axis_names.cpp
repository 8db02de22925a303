// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/axis_names.hpp"

#include <algorithm>
#include <initializer_list>
#include <string>

namespace terrace::stream {
namespace {

bool is_among(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// Says that the rest of a name is a coordinate, or its unit.
bool is_decoration(std::string_view word) {
  return is_among(word,
                  {"point", "pos", "position", "coord", "coordinate", "utm", "m", "meter", "meters",
                   "metre", "metres", "ft", "feet", "deg", "degree", "degrees", "dd"});
}

/// The name in lower case without brackets, decorations and what separates words. decorated: it had
/// such words.
std::string bare_name(std::string_view name, bool& decorated) {
  std::string bare, word;
  const auto end_word = [&] {
    if (is_decoration(word)) {
      decorated = true;
    } else {
      bare += word;
    }
    word.clear();
  };
  for (const char c : name.substr(0, name.find_first_of("([{"))) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool part = upper || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
                      static_cast<unsigned char>(c) >= 0x80;
    if (part) {
      word += upper ? static_cast<char>(c - 'A' + 'a') : c;
    } else {
      end_word();
    }
  }
  end_word();
  decorated = decorated || bare.size() != name.size();
  return bare;
}

/// "pointx", "xcoord": written as one word.
std::string_view letter_within(std::string_view bare) {
  for (const std::string_view before : {"point", "coord", "coordinate", "pos", "position"}) {
    if (bare.size() == before.size() + 1 && bare.starts_with(before)) {
      return bare.substr(before.size());
    }
    if (bare.size() == before.size() + 1 && bare.ends_with(before)) return bare.substr(0, 1);
  }
  return {};
}

}  // namespace

std::optional<AxisName> axis_named(std::string_view name) {
  bool decorated = false;
  const std::string bare = bare_name(name, decorated);
  std::string_view letter = bare;
  if (const std::string_view within = letter_within(bare); !within.empty()) {
    letter = within;
    decorated = true;
  }
  if (is_among(letter, {"x", "y", "z"})) {
    return AxisName{.axis = static_cast<std::size_t>(letter[0] - 'x'),
                    .kind = decorated ? AxisNameKind::with_letter : AxisNameKind::letter};
  }
  const auto word = [](std::size_t axis, bool angle = false) {
    return AxisName{.axis = axis, .kind = AxisNameKind::word, .angle = angle};
  };
  if (is_among(bare, {"easting", "eastings", "east", "rechtswert"})) return word(0);
  if (is_among(bare, {"northing", "northings", "north", "hochwert"})) return word(1);
  if (is_among(bare, {"lon", "long", "lng", "longitude"})) return word(0, true);
  if (is_among(bare, {"lat", "latitude"})) return word(1, true);
  if (is_among(bare, {"h", "height", "elevation", "elev", "ele", "alt", "altitude", "hoehe",
                      "h\xC3\xB6he"})) {
    return word(2);
  }
  if (bare == "e") return AxisName{.axis = 0, .kind = AxisNameKind::abbreviation};
  if (bare == "n") return AxisName{.axis = 1, .kind = AxisNameKind::abbreviation};
  return std::nullopt;
}

}  // namespace terrace::stream
