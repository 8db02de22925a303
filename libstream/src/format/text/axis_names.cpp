// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/axis_names.hpp"

#include <algorithm>
#include <initializer_list>
#include <string>

#include "io/text.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

bool is_among(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool is_degree(std::string_view word) {
  return is_among(word, {"deg", "degree", "degrees", "dd", "\xC2\xB0"});
}

/// True for a unit that may end a name without brackets. Single letters such as "h" do not count.
bool is_suffix_unit(std::string_view word) {
  return is_among(word, {"m", "meter", "meters", "metre", "metres", "ft", "foot", "feet", "usft",
                         "ftus", "km", "cm", "mm"});
}

/// Returns the longest prefix of the words that is a unit.
std::string unit_of_words(std::string_view words) {
  if (is_degree(words)) return "degree";
  for (std::size_t end = words.size(); end != 0 && end != words.npos;
       end = words.find_last_of(" ,;", end - 1)) {
    const std::string unit = canonical_unit(words.substr(0, end));
    if (is_length_unit(unit)) return unit;
  }
  return {};
}

/// True for a word that shows that the rest of a name is a coordinate, or names its unit.
bool is_decoration(std::string_view word) {
  return is_among(word, {"point", "pos", "position", "coord", "coordinate", "utm", "us", "survey",
                         "intl", "deg", "degree", "degrees", "dd"}) ||
         is_suffix_unit(word);
}

/// Returns the name in lower case without brackets, decorations and separators of words. decorated:
/// set to true if it had any of these.
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

/// Returns the letter of an axis in names such as "pointx" or "xcoord"; empty for other names.
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
  if (const std::string_view inner_letter = letter_within(bare); !inner_letter.empty()) {
    letter = inner_letter;
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

std::string axis_unit(std::string_view name) {
  constexpr std::string_view kOpen = "([{", kClose = ")]}";
  if (const std::size_t open = name.find_first_of(kOpen); open != name.npos) {
    const std::string_view inside = name.substr(open + 1);
    const std::size_t last = inside.find_last_of(kClose);
    const std::string words(trim(inside.substr(0, last)));
    const std::string unit = unit_of_words(lower_case(words));
    return unit.empty() ? words : unit;
  }
  // Starts with the last word and adds words before it as long as they are parts of one unit.
  std::string unit;
  for (std::size_t at = name.find_last_of("_ -."); at != name.npos && at > 0;
       at = name.find_last_of("_ -.", at - 1)) {
    const std::string longer = canonical_unit(name.substr(at + 1));
    if (!is_length_unit(longer)) break;
    unit = longer;
  }
  return unit;
}

}  // namespace terrace::stream
