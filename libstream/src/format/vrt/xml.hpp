// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream {

/// An element of an XML document, with all elements below it.
struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes{};
  std::string text{};  ///< between its tags, without the text of children
  std::vector<XmlElement> children{};

  /// Returns the first child of that name; nullptr if there is none.
  [[nodiscard]] const XmlElement* child(std::string_view name) const;
  /// Returns the value of an attribute; empty if there is none.
  [[nodiscard]] std::string attribute(const std::string& name) const;
};

/// Receives a complete element and its ancestors `open`, the root first, which are not yet
/// complete. Returns true if the element need not be kept. May throw.
using TakeElement =
    std::function<bool(std::span<const XmlElement> open, const XmlElement& element)>;

/// Returns the document's root, without the elements for which `take` returned true. Documents that
/// declare a document type are refused, so entities cannot grow and no other file is read.
/// Throws: Error naming line and cause if the file is not XML, is larger than 256 MiB, is nested
/// deeper than 32, has a tag of more than 4 MiB, or needs more than 64 MiB for the kept elements.
/// Throws what `take` throws.
XmlElement read_xml(const std::string& file, const TakeElement& take);

}  // namespace terrace::stream
