// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>

#include <fcntl.h>
#include <terrace/stream/sink.hpp>
#include <unistd.h>

#include "cli/interrupt.hpp"

namespace terrace::tools {
namespace {

unsigned char byte_at(std::string_view text, std::size_t i) {
  return i < text.size() ? static_cast<unsigned char>(text[i]) : 0;
}

/// Returns the length of the UTF-8 character (RFC 3629) at the start of `text`, or 0 if it is
/// invalid.
std::size_t character_length(std::string_view text, std::uint32_t& code) {
  const unsigned char first = byte_at(text, 0);
  if (first < 0x80) {
    code = first;
    return 1;
  }
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  constexpr std::array<std::uint32_t, 5> kMinCode{0, 0, 0x80, 0x800, 0x10000};
  if (first < 0xC0 || first > 0xF4) return 0;
  code = first & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte_at(text, i) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte_at(text, i) & 0x3FU);
  }
  if (code < kMinCode[length] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return 0;
  return length;
}

bool acts_on_terminal(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

std::string escaped_controls(std::string_view text, bool keep_line_ends) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    std::uint32_t code = 0;
    const std::size_t length = character_length(text, code);
    if (length == 0) code = 0;
    if ((code == '\n' && keep_line_ends) || (length > 0 && !acts_on_terminal(code))) {
      out.append(text.substr(0, length));
    } else if (code == '\n' || code == '\t') {
      out += code == '\n' ? "\\n" : "\\t";
    } else {
      for (std::size_t i = 0; i < (length == 0 ? 1 : length); ++i) {
        constexpr const char* kDigits = "0123456789abcdef";
        const unsigned char byte = byte_at(text, i);
        out.append("\\x").append(1, kDigits[byte >> 4]).append(1, kDigits[byte & 15]);
      }
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return out;
}

}  // namespace

std::string printable(std::string_view text) { return escaped_controls(text, true); }

std::string printable_line(std::string_view text) { return escaped_controls(text, false); }

void print_message(std::string_view line) {
  while (line.ends_with('\n')) line.remove_suffix(1);
  print_lines("terrace: " + printable_line(line) + "\n");
}

void print_lines(std::string_view text) { std::fputs(printable(text).c_str(), stderr); }

void print_result(std::string_view text) {
  // Ctrl-C ends a write that waits for a reader, but not the summary of `terrace view`, which runs
  // until Ctrl-C.
  stream::Sink output("-", false, interrupted() ? std::stop_token() : stop_token());
  output.write(text);
  output.commit();
}

void secure_standard_descriptors() noexcept {
  constexpr std::array<int, 3> kModes{O_WRONLY, O_RDONLY, O_RDONLY};
  for (int descriptor = 0; descriptor < 3; ++descriptor) {
    if (::fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // open() returns the lowest free number, which is the missing one. Without /dev/null a folder
    // works: it cannot be read or written either.
    if (::open("/dev/null", kModes[static_cast<std::size_t>(descriptor)]) < 0 &&
        ::open("/", O_RDONLY | O_DIRECTORY) < 0) {
      ::_exit(1);
    }
  }
}

}  // namespace terrace::tools
