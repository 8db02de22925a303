// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/unit_words.hpp"

#include <algorithm>
#include <array>

#include "io/text.hpp"

namespace terrace::stream {
namespace {

/// A unit and all other words for it, in lower case, separated by commas.
struct UnitWords {
  std::string_view name, words;
};

constexpr std::array<UnitWords, 18> kUnitWords{{
    {"metre", "m,metres,meter,meters,mtr,international metre,international meter"},
    {"foot",
     "ft,feet,ift,foot intl,feet intl,ft intl,intl foot,intl feet,intl ft,international foot,"
     "international feet,foot international,feet international,ft international"},
    {"US survey foot",
     "us ft,usft,ftus,ft us,sft,sfoot,sfeet,survey foot,survey feet,us foot,us feet,foot us,"
     "feet us,us survey feet,us survey ft,foot us survey,feet us survey,us surveyfoot,"
     "us surveyfeet,survey foot us,survey feet us"},
    {"kilometre", "km,kilometres,kilometer,kilometers"},
    {"hectometre", "hm,hectometres,hectometer,hectometers"},
    {"decametre", "dam,decametres,decameter,decameters"},
    {"decimetre", "dm,decimetres,decimeter,decimeters"},
    {"centimetre", "cm,centimetres,centimeter,centimeters"},
    {"millimetre", "mm,millimetres,millimeter,millimeters"},
    {"inch", "in,inches"},
    {"US survey inch", "us in,us inch,us inches"},
    {"yard", "yd,yards,international yard,international yards"},
    {"US survey yard", "us yd,us yard,us yards"},
    {"fathom", "fath,fathoms,international fathom"},
    {"mile", "mi,miles,statute mile,international mile"},
    {"US survey mile", "us mi,us mile,us miles,us statute mile"},
    {"nautical mile", "nmi,kmi,nm,nautical miles,international nautical mile"},
    {"Clarke's foot", "clarkes foot,clarkes feet,foot clarke,ft cla"},
}};

/// Returns the text in lower case, without dots, apostrophes and brackets, and with other runs of
/// signs as single blanks.
std::string plain_words(std::string_view text) {
  std::string plain;
  for (const char c : lower_case(std::string(text))) {
    if (c == '.' || c == '\'' || c == '(' || c == ')' || c == '[' || c == ']') continue;
    const bool gap = is_white_space(c) || c == '_' || c == '-';
    if (!gap) {
      plain += c;
    } else if (!plain.empty() && plain.back() != ' ') {
      plain += ' ';
    }
  }
  while (!plain.empty() && plain.back() == ' ') plain.pop_back();
  return plain;
}

bool is_one_of(std::string_view words, std::string_view word) {
  while (!words.empty()) {
    const std::string_view first = words.substr(0, words.find(','));
    if (first == word) return true;
    words.remove_prefix(std::min(words.size(), first.size() + 1));
  }
  return false;
}

}  // namespace

std::string canonical_unit(std::string_view text) {
  const std::string plain = plain_words(text);
  for (const UnitWords& unit : kUnitWords) {
    if (plain == plain_words(unit.name) || is_one_of(unit.words, plain)) {
      return std::string(unit.name);
    }
  }
  return std::string(trim(text));
}

bool is_length_unit(std::string_view name) {
  return std::any_of(kUnitWords.begin(), kUnitWords.end(),
                     [name](const UnitWords& unit) { return unit.name == name; });
}

}  // namespace terrace::stream
