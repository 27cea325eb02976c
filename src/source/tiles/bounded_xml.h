// XML from servers, which may be hostile: no entities but XML's own, no document types, within bounds. Elements go by their
// names without prefixes.
// Thread-safe: pure functions.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <pugixml.hpp>

#include "base/result.h"

namespace tellurion::source {

/// A document; its nodes live as long as it does.
using XmlDocument = std::unique_ptr<pugi::xml_document>;

/// At most 64 MB and 2 million elements. Errors: corrupt (no XML; says what it is instead, and the line), exhausted (too large).
Result<XmlDocument> read_xml(std::string_view bytes);

/// The element's or attribute's name without its prefix.
std::string_view local_name(const pugi::xml_node& node);
std::string_view local_name(const pugi::xml_attribute& attribute);

/// The first child element of the name; a null node, which has no children either, if there is none.
pugi::xml_node child(const pugi::xml_node& node, std::string_view name);
std::vector<pugi::xml_node> children(const pugi::xml_node& node, std::string_view name);

/// The element's own text or an attribute's, without blanks at its ends, at most 8 kB; empty if there is none.
std::string text_of(const pugi::xml_node& node);
std::string child_text(const pugi::xml_node& node, std::string_view name);
std::string attribute(const pugi::xml_node& node, std::string_view name);

/// Texts as numbers; whole numbers that fit into 2^53.
std::optional<double> attribute_number(const pugi::xml_node& node, std::string_view name);
std::optional<double> child_number(const pugi::xml_node& node, std::string_view name);
std::optional<std::int64_t> child_count(const pugi::xml_node& node, std::string_view name);

/// "1.5 -2": two numbers with blanks or a comma between them.
std::optional<std::pair<double, double>> two_numbers(std::string_view text);

/// What an exception report says (of WMS or OWS): one line; nothing if the document is none.
std::optional<std::string> exception_text(const pugi::xml_document& document);

/// What a server says instead of a picture: the line of an exception report, or that it is a page of HTML; nothing if the
/// bytes are neither.
std::optional<std::string> service_exception(std::string_view bytes);

}  // namespace tellurion::source
