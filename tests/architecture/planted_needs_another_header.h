#pragma once
inline std::string text() { return "this header does not include <string>"; }
