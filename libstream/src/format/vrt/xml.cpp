// SPDX-License-Identifier: Apache-2.0
#include "format/vrt/xml.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include <expat.h>

#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;
constexpr std::uint64_t kMaxTagBytes = std::uint64_t{4} << 20;
constexpr std::size_t kMaxHeldBytes = std::size_t{64} << 20;
constexpr std::size_t kDeepest = 32;

/// The size of a node of a map with two short strings.
constexpr std::size_t kAttributeBytes = 112;

/// The state of the parser. Its handlers are called from C and must not throw.
struct XmlParseState {
  XML_Parser parser = nullptr;
  const TakeElement* take = nullptr;
  XmlElement root{};
  std::vector<XmlElement> open{};    ///< incomplete elements, the root first
  std::vector<std::size_t> bytes{};  ///< held by each of these and its kept children
  std::size_t total_bytes = 0;       ///< the sum of `bytes`
  std::uint64_t parsed = 0;          ///< bytes of the file up to the end of the last event
  std::string refusal{};
  std::exception_ptr failure{};

  void stop() const { XML_StopParser(parser, XML_FALSE); }
  /// Counts more bytes held for the innermost element.
  void hold(std::size_t more) {
    bytes.back() += more;
    total_bytes += more;
    if (total_bytes <= kMaxHeldBytes) return;
    refusal = "it is too large for a description";
    stop();
  }

  template <class Work>
  static void guard(void* self, const Work& work) {
    auto& state = *static_cast<XmlParseState*>(self);
    state.parsed = static_cast<std::uint64_t>(XML_GetCurrentByteIndex(state.parser)) +
                   static_cast<std::uint64_t>(XML_GetCurrentByteCount(state.parser));
    try {
      work(state);
    } catch (...) {
      state.failure = std::current_exception();
      state.stop();
    }
  }
};

void on_start(void* self, const XML_Char* name, const XML_Char** attributes) {
  XmlParseState::guard(self, [&](XmlParseState& state) {
    if (state.open.size() == kDeepest) {
      state.refusal = "its elements are nested too deeply";
      return state.stop();
    }
    if (static_cast<std::uint64_t>(XML_GetCurrentByteCount(state.parser)) > kMaxTagBytes) {
      state.refusal = "has a tag that is too long";
      return state.stop();
    }
    XmlElement element{.name = name};
    std::size_t bytes = sizeof element + element.name.size();
    for (; *attributes != nullptr; attributes += 2) {
      std::string& value = element.attributes[attributes[0]];
      value = attributes[1];
      bytes += kAttributeBytes + value.size();
    }
    state.open.push_back(std::move(element));
    state.bytes.push_back(0);
    state.hold(bytes);
  });
}

void on_end(void* self, const XML_Char* /*name*/) {
  XmlParseState::guard(self, [](XmlParseState& state) {
    XmlElement element = std::move(state.open.back());
    const std::size_t bytes = state.bytes.back();
    state.open.pop_back();
    state.bytes.pop_back();
    if (state.open.empty()) {
      state.root = std::move(element);
    } else if ((*state.take)(state.open, element)) {
      state.total_bytes -= bytes;
    } else {
      state.bytes.back() += bytes;
      state.open.back().children.push_back(std::move(element));
    }
  });
}

void on_text(void* self, const XML_Char* text, int size) {
  XmlParseState::guard(self, [&](XmlParseState& state) {
    if (state.open.empty()) return;
    state.open.back().text.append(text, static_cast<std::size_t>(size));
    state.hold(static_cast<std::size_t>(size));
  });
}

/// Called for comments and other content.
void on_other(void* self, const XML_Char*, int) {
  XmlParseState::guard(self, [](XmlParseState&) {});
}

void on_document_type(void* self, const XML_Char*, const XML_Char*, const XML_Char*, int) {
  auto& state = *static_cast<XmlParseState*>(self);
  XmlParseState::guard(self, [](XmlParseState& r) { r.refusal = "it declares a document type"; });
  state.stop();
}

}  // namespace

const XmlElement* XmlElement::child(std::string_view expected_name) const {
  const auto at = std::find_if(children.begin(), children.end(), [&](const XmlElement& element) {
    return element.name == expected_name;
  });
  return at == children.end() ? nullptr : &*at;
}

std::string XmlElement::attribute(const std::string& expected_name) const {
  const auto at = attributes.find(expected_name);
  return at == attributes.end() ? std::string() : at->second;
}

XmlElement read_xml(const std::string& file, const TakeElement& take) {
  const auto bytes = open_file(file);
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, void (*)(XML_Parser)> parser(
      XML_ParserCreate(nullptr), &XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  XmlParseState state{.parser = parser.get(), .take = &take};
  const auto fault = [&](const std::string& cause) {
    return Error(file, cause)
        .at_line(XML_GetCurrentLineNumber(parser.get()))
        .remedy("the file is damaged: export it again");
  };
  if (bytes->size() > kMaxBytes) throw fault("is too large for a description");
  XML_SetUserData(parser.get(), &state);
  XML_SetElementHandler(parser.get(), &on_start, &on_end);
  XML_SetCharacterDataHandler(parser.get(), &on_text);
  XML_SetDefaultHandlerExpand(parser.get(), &on_other);
  XML_SetStartDoctypeDeclHandler(parser.get(), &on_document_type);
  std::array<char, 64u << 10> piece;
  std::uint64_t at = 0;
  do {
    const auto size =
        static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), bytes->size() - at));
    bytes->read(at, std::as_writable_bytes(std::span(piece).first(size)));
    at += size;
    const XML_Status status = XML_Parse(parser.get(), piece.data(), static_cast<int>(size),
                                        at == bytes->size() ? XML_TRUE : XML_FALSE);
    if (state.failure) std::rethrow_exception(state.failure);
    if (!state.refusal.empty()) throw fault(state.refusal);
    // Some versions of the parser look at an incomplete tag again only when it has doubled.
    if (at > state.parsed + 2 * kMaxTagBytes) throw fault("has a tag that is too long");
    if (status != XML_STATUS_OK) {
      throw fault(std::string("is not XML: ") + XML_ErrorString(XML_GetErrorCode(parser.get())));
    }
  } while (at < bytes->size());
  return std::move(state.root);
}

}  // namespace terrace::stream
