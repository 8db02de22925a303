// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/crs/wkt.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "earth/crs/crs_definition.hpp"

namespace terrace::terrain {
namespace {

constexpr char kRemedy[] = "correct the text, or name the system by its code: --crs EPSG:n";

bool same_keyword(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return (x >= 'a' && x <= 'z' ? static_cast<char>(x - 32) : x) == y;
  });
}

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  WktNode whole() {
    WktNode node = value(0);
    skip_blanks();
    if (at_ != text_.size()) fail("goes on behind its end");
    return node;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw CrsError("the WKT " + what + " (character " + std::to_string(at_ + 1) + ")", kRemedy);
  }
  void skip_blanks() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != text_.npos) ++at_;
  }
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }

  std::string quoted() {
    std::string result;
    for (++at_;; ++at_) {
      if (at_ >= text_.size()) fail("ends within a name");
      if (text_[at_] == '"') {
        // A doubled quote stands for one.
        if (at_ + 1 >= text_.size() || text_[at_ + 1] != '"') break;
        ++at_;
      }
      result += text_[at_];
    }
    ++at_;
    return result;
  }

  WktNode value(int depth) {
    constexpr int kDeepest = 32;
    if (depth > kDeepest) fail("is nested too deeply");
    skip_blanks();
    WktNode node;
    if (peek() == '"') {
      node.text = quoted();
      node.quoted = true;
      return node;
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() &&
           std::string_view("[](), \t\r\n\"").find(text_[at_]) == text_.npos) {
      ++at_;
    }
    node.text = text_.substr(begin, at_ - begin);
    if (node.text.empty()) fail(at_ == text_.size() ? "ends too early" : "has an empty part");
    skip_blanks();
    if (peek() != '[' && peek() != '(') return node;
    for (char& c : node.text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
    do {
      ++at_;
      node.parts.push_back(value(depth + 1));
      skip_blanks();
    } while (peek() == ',');
    if (peek() != ']' && peek() != ')') fail("lacks a closing bracket");
    ++at_;
    return node;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

const WktNode* WktNode::find(std::initializer_list<std::string_view> keywords) const {
  for (const WktNode& part : parts) {
    if (part.quoted || part.parts.empty()) continue;
    for (const std::string_view keyword : keywords) {
      if (same_keyword(part.text, keyword)) return &part;
    }
  }
  return nullptr;
}

std::string WktNode::name() const {
  return !parts.empty() && parts.front().quoted ? parts.front().text : std::string();
}

double WktNode::number(std::size_t i) const {
  double value = 0;
  if (i < parts.size()) {
    std::string_view digits = parts[i].text;
    if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc{} && end == digits.data() + digits.size() && std::isfinite(value)) {
      return value;
    }
  }
  throw CrsError("the WKT lacks a number in " + text + "[\"" + name() + "\"]", kRemedy);
}

int WktNode::epsg() const {
  const WktNode* const id = find({"AUTHORITY", "ID"});
  if (id == nullptr || id->parts.size() < 2 || plain_name(id->parts[0].text) != "epsg") return 0;
  const std::string& digits = id->parts[1].text;
  int code = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), code);
  return code;
}

WktNode parse_wkt(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return Parser(text).whole();
}

std::string plain_name(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') {
      plain += static_cast<char>(c + 32);
    } else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
      plain += c;
    }
  }
  return plain;
}

}  // namespace terrace::terrain
