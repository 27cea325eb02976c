// URLs of requests to services: parameters and what refers to something else.
// Thread-safe: pure functions.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tellurion::source {

using Parameters = std::vector<std::pair<std::string, std::string>>;

/// `text` as a part of a path or a parameter's value; colons, commas and slashes need no escape there, slashes in paths do.
std::string escaped(std::string_view text, bool in_path = false);

/// Whether the query has a parameter of the name, in capitals or not.
bool has_parameter(std::string_view url, std::string_view name);

/// With these parameters, escaped, in place of those of the same names. What follows a # goes.
std::string with_parameters(std::string_view url, const Parameters& parameters);

/// Whether both are of the same server: scheme, host and port. False if one is no URL.
bool same_server(std::string_view a, std::string_view b);

/// With those parameters of `given`, a URL that the user wrote, that `url`, which its service named, does not have itself and
/// that are no part of the service's protocol: keys, above all. Only if both are of the same server.
std::string with_given_parameters(std::string_view url, std::string_view given);

/// `message` without the values of those parameters of `url` that `shown`, its public form, lacks.
std::string without_secrets(std::string message, std::string_view url, std::string_view shown);

/// What `reference` in a document at `base` means: whole, of the same scheme ("//host/a"), from the host's root ("/a"), or relative to
/// the document's folder.
std::string resolved_url(std::string_view base, std::string_view reference);

}  // namespace tellurion::source
