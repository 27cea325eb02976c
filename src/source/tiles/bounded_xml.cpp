#include "source/tiles/bounded_xml.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "base/number.h"

namespace tellurion::source {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;
constexpr std::ptrdiff_t kMostElements = 2'000'000;
constexpr std::size_t kMostText = 8192;
constexpr std::size_t kMostMessage = 300;
constexpr std::size_t kMostReport = std::size_t{256} << 10;  ///< bytes of an exception report

bool is_blank(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view without_prefix(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

std::string bounded(const char* text) {
  const std::string_view all = trimmed(text);
  return std::string(all.substr(0, kMostText));
}

bool is_html(std::string_view bytes) {
  std::string head(trimmed(bytes.substr(0, 512)));
  std::transform(head.begin(), head.end(), head.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return head.starts_with("<!doctype html") || head.find("<html") != std::string::npos;
}

/// Blanks of any kind become one, what does not print a dot.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : trimmed(text)) {
    if (is_blank(c)) {
      if (!line.empty() && line.back() != ' ') line += ' ';
    } else {
      line += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '.' : c;
    }
    if (line.size() >= kMostMessage) return line + "...";
  }
  return line;
}

}  // namespace

Result<XmlDocument> read_xml(std::string_view bytes) {
  if (bytes.size() > kMostBytes) return Error{ErrorCode::exhausted, fmt::format("has {} MB, more than the {} MB that are read", bytes.size() >> 20, kMostBytes >> 20)};
  if (std::count(bytes.begin(), bytes.end(), '<') > kMostElements) return Error{ErrorCode::exhausted, "has more than two million elements"};
  if (trimmed(bytes).empty()) return Error{ErrorCode::corrupt, "is empty"};
  if (is_html(bytes)) return Error{ErrorCode::corrupt, "is a page of HTML, not the XML that was asked for; is the URL right?"};
  auto document = std::make_unique<pugi::xml_document>();
  const pugi::xml_parse_result parsed = document->load_buffer(bytes.data(), bytes.size());
  if (!parsed) {
    const auto reached = std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(parsed.offset, 0)), bytes.size());
    const auto line = 1 + std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(reached), '\n');
    return Error{ErrorCode::corrupt, fmt::format("is no valid XML: line {}: {}", line, parsed.description())};
  }
  return document;
}

std::string_view local_name(const pugi::xml_node& node) { return without_prefix(node.name()); }
std::string_view local_name(const pugi::xml_attribute& attribute) { return without_prefix(attribute.name()); }

pugi::xml_node child(const pugi::xml_node& node, std::string_view name) {
  for (pugi::xml_node at = node.first_child(); at; at = at.next_sibling()) {
    if (local_name(at) == name) return at;
  }
  return {};
}

std::vector<pugi::xml_node> children(const pugi::xml_node& node, std::string_view name) {
  std::vector<pugi::xml_node> found;
  for (pugi::xml_node at = node.first_child(); at; at = at.next_sibling()) {
    if (local_name(at) == name) found.push_back(at);
  }
  return found;
}

std::string text_of(const pugi::xml_node& node) { return bounded(node.text().get()); }
std::string child_text(const pugi::xml_node& node, std::string_view name) { return text_of(child(node, name)); }

std::string attribute(const pugi::xml_node& node, std::string_view name) {
  for (pugi::xml_attribute at = node.first_attribute(); at; at = at.next_attribute()) {
    if (local_name(at) == name) return bounded(at.value());
  }
  return {};
}

std::optional<double> attribute_number(const pugi::xml_node& node, std::string_view name) { return parse_number(attribute(node, name)); }
std::optional<double> child_number(const pugi::xml_node& node, std::string_view name) { return parse_number(child_text(node, name)); }

std::optional<std::int64_t> child_count(const pugi::xml_node& node, std::string_view name) {
  constexpr double kMost = 9007199254740992.0;  // 2^53
  const auto number = child_number(node, name);
  if (!number || *number < 0 || *number > kMost || *number != std::floor(*number)) return std::nullopt;
  return static_cast<std::int64_t>(*number);
}

std::optional<std::pair<double, double>> two_numbers(std::string_view text) {
  text = trimmed(text);
  const std::size_t end = text.find_first_of(" \t\r\n,");
  if (end == std::string_view::npos) return std::nullopt;
  std::string_view rest = trimmed(text.substr(end));
  if (rest.starts_with(",")) rest.remove_prefix(1);
  const auto first = parse_number(text.substr(0, end)), second = parse_number(rest);
  if (!first || !second) return std::nullopt;
  return std::pair(*first, *second);
}

std::optional<std::string> exception_text(const pugi::xml_document& document) {
  const pugi::xml_node root = document.document_element();
  const bool wms = local_name(root) == "ServiceExceptionReport";
  if (!wms && local_name(root) != "ExceptionReport") return std::nullopt;
  const pugi::xml_node first = child(root, wms ? "ServiceException" : "Exception");
  const std::string code = one_line(attribute(first, wms ? "code" : "exceptionCode"));
  std::string said = one_line(wms ? text_of(first) : child_text(first, "ExceptionText"));
  if (said.empty()) said = code.empty() ? "an exception without a word" : code;
  else if (!code.empty()) said = fmt::format("{} ({})", said, code);
  return said;
}

std::optional<std::string> service_exception(std::string_view bytes) {
  const std::string_view head = trimmed(bytes.substr(0, 256));
  if (!head.starts_with('<') && !head.starts_with("\xEF\xBB\xBF<")) return std::nullopt;
  if (is_html(bytes)) return "a page of HTML";
  const Result<XmlDocument> document = read_xml(bytes.substr(0, kMostReport));
  if (!document) return std::nullopt;
  return exception_text(**document);
}

}  // namespace tellurion::source
