// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream {

/// An element of an XML document, with all below it.
struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes{};
  std::string text{};  ///< between its tags, that of children left out
  std::vector<XmlElement> children{};

  /// The first child of that name; nullptr if there is none.
  [[nodiscard]] const XmlElement* child(std::string_view name) const;
  /// Empty if there is none.
  [[nodiscard]] std::string attribute(const std::string& name) const;
};

/// Looks at an element that has come to its end, below those of `open`, the root first, which have
/// not: true if it need not be kept. May throw.
using TakeElement = std::function<bool(std::span<const XmlElement> open, const XmlElement& done)>;

/// The document's root, without the elements that `take` has taken. Documents that declare entities
/// or other types are refused, so nothing grows beyond the file and nothing else is read.
/// Throws: Error naming line and cause for what is not XML, is larger than 256 MiB, nested deeper
/// than 32, has a tag of more than 4 MiB, or has more to be kept than 64 MiB hold; what `take`
/// throws.
XmlElement read_xml(const std::string& file, const TakeElement& take);

}  // namespace terrace::stream
