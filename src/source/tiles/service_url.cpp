#include "source/tiles/service_url.h"

#include <algorithm>
#include <cctype>
#include <cstddef>

#include <fmt/format.h>

namespace tellurion::source {
namespace {

/// What WMS and WMTS themselves ask with.
constexpr std::string_view kProtocol[] = {"service", "request", "version", "acceptversions", "layer", "layers", "style", "styles", "format", "crs", "srs", "bbox",
                                          "width", "height", "transparent", "tilematrixset", "tilematrix", "tilerow", "tilecol", "exceptions", "sections", "updatesequence"};

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

std::string_view without_fragment(std::string_view url) { return url.substr(0, url.find('#')); }

/// "name=value" as written.
std::vector<std::string_view> query_parts(std::string_view url) {
  url = without_fragment(url);
  std::vector<std::string_view> parts;
  const std::size_t question = url.find('?');
  if (question == std::string_view::npos) return parts;
  std::string_view rest = url.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

std::string name_of_part(std::string_view part) { return lower(part.substr(0, part.find('='))); }

/// "scheme://host:port", without who asks; empty if there is none.
std::string server_of(std::string_view url) {
  const std::size_t start = url.find("://");
  if (start == std::string_view::npos) return {};
  std::string_view host = url.substr(start + 3);
  host = host.substr(0, host.find_first_of("/?#"));
  if (const std::size_t user = host.rfind('@'); user != std::string_view::npos) host.remove_prefix(user + 1);
  const std::string scheme = lower(url.substr(0, start));
  const std::size_t colon = host.rfind(':');
  const bool has_port = colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos;
  std::string port(has_port ? host.substr(colon + 1) : "");
  if (port.empty()) port = scheme == "https" ? "443" : "80";
  host = host.substr(0, has_port ? colon : host.size());
  return host.empty() ? std::string() : fmt::format("{}://{}:{}", scheme, lower(host), port);
}

std::string joined(std::string_view url, const std::vector<std::string>& parts) {
  std::string out(without_fragment(url).substr(0, url.find('?')));
  char joint = '?';
  for (const std::string& part : parts) {
    out += joint;
    out += part;
    joint = '&';
  }
  return out;
}

}  // namespace

std::string escaped(std::string_view text, bool in_path) {
  const std::string_view plain = in_path ? "-._~:,@" : "-._~:,/";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x80 && std::isalnum(byte) != 0) || plain.find(c) != std::string_view::npos) out += c;
    else out += fmt::format("%{:02X}", byte);
  }
  return out;
}

bool has_parameter(std::string_view url, std::string_view name) {
  const auto parts = query_parts(url);
  return std::any_of(parts.begin(), parts.end(), [&](std::string_view part) { return name_of_part(part) == lower(name); });
}

std::string with_parameters(std::string_view url, const Parameters& parameters) {
  std::vector<std::string> parts;
  for (const std::string_view part : query_parts(url)) {
    const bool replaced = std::any_of(parameters.begin(), parameters.end(), [&](const auto& p) { return lower(p.first) == name_of_part(part); });
    if (!replaced) parts.emplace_back(part);
  }
  for (const auto& [name, value] : parameters) parts.push_back(name + "=" + escaped(value));
  return joined(url, parts);
}

bool same_server(std::string_view a, std::string_view b) {
  const std::string server = server_of(a);
  return !server.empty() && server == server_of(b);
}

std::string with_given_parameters(std::string_view url, std::string_view given) {
  if (!same_server(url, given)) return std::string(url);
  std::vector<std::string> parts;
  for (const std::string_view part : query_parts(url)) parts.emplace_back(part);
  for (const std::string_view part : query_parts(given)) {
    const std::string name = name_of_part(part);
    const bool protocol = std::find(std::begin(kProtocol), std::end(kProtocol), name) != std::end(kProtocol);
    if (!protocol && !has_parameter(url, name)) parts.emplace_back(part);
  }
  return joined(url, parts);
}

std::string without_secrets(std::string message, std::string_view url, std::string_view shown) {
  for (const std::string_view part : query_parts(url)) {
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || part.size() == equals + 1 || has_parameter(shown, part.substr(0, equals))) continue;
    const std::string_view value = part.substr(equals + 1);
    for (std::size_t at = message.find(value); at != std::string::npos; at = message.find(value, at + 3)) message.replace(at, value.size(), "...");
  }
  return message;
}

std::string resolved_url(std::string_view base, std::string_view reference) {
  if (reference.find("://") < reference.find_first_of("/?#")) return std::string(reference);
  base = without_fragment(base).substr(0, base.find('?'));
  const std::size_t start = base.find("://");
  const std::size_t root = start == std::string_view::npos ? 0 : std::min(base.find('/', start + 3), base.size());
  if (reference.starts_with("//")) return std::string(base.substr(0, start == std::string_view::npos ? 0 : start + 1)) + std::string(reference);
  if (reference.starts_with("/")) return std::string(base.substr(0, root)) + std::string(reference);
  while (reference.starts_with("./")) reference.remove_prefix(2);
  const std::size_t folder = base.rfind('/');
  const bool has_folder = folder != std::string_view::npos && folder >= root;
  return std::string(has_folder ? base.substr(0, folder) : base) + "/" + std::string(reference);
}

}  // namespace tellurion::source
