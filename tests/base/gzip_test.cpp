#include "base/gzip.h"

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include <doctest/doctest.h>

using namespace tellurion;

namespace {

// printf 'A planet has no edge.\n' | gzip -n -9 (gzip 1.12)
constexpr auto kSentence = std::to_array<unsigned char>(
    {0x1f, 0x8b, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x03, 0x73, 0x54, 0x28, 0xc8, 0x49, 0xcc, 0x4b, 0x2d, 0x51, 0xc8,
     0x48, 0x2c, 0x56, 0xc8, 0xcb, 0x57, 0x48, 0x4d, 0x49, 0x4f, 0xd5, 0xe3, 0x02, 0x00, 0x1f, 0xe2, 0xfd, 0x34, 0x16, 0x00,
     0x00, 0x00});
constexpr std::string_view kUnpacked = "A planet has no edge.\n";

// 100,000 times the letter a, packed likewise.
constexpr auto kLetters = std::to_array<unsigned char>(
    {0x1f, 0x8b, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x03, 0xed, 0xc1, 0x31, 0x01, 0x00, 0x00, 0x00, 0xc2, 0xa0, 0xac,
     0xeb, 0x5f, 0xc2, 0x1a, 0x1e, 0x40, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
     0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
     0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
     0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
     0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
     0x00, 0x00, 0x00, 0xaf, 0x06, 0x87, 0xfa, 0xe2, 0x1b, 0xa0, 0x86, 0x01, 0x00});

template <std::size_t N>
std::string text_of(const std::array<unsigned char, N>& bytes) {
  return {bytes.begin(), bytes.end()};
}

ErrorCode code_of(const std::string& bytes, std::size_t most_bytes = 1000) {
  const Result<std::string> unpacked = gunzip(bytes, most_bytes);
  REQUIRE_FALSE(unpacked);
  CHECK_FALSE(unpacked.error().message.empty());
  return unpacked.error().code;
}

}  // namespace

TEST_CASE("gunzip: gives back what gzip packed") {
  const auto sentence = gunzip(text_of(kSentence), kUnpacked.size());
  REQUIRE(sentence);
  CHECK(*sentence == kUnpacked);
  const auto letters = gunzip(text_of(kLetters), 100000);
  REQUIRE(letters);
  CHECK(*letters == std::string(100000, 'a'));
}

TEST_CASE("gunzip: members that follow one another are joined") {
  const auto both = gunzip(text_of(kSentence) + text_of(kSentence), 1000);
  REQUIRE(both);
  CHECK(*both == std::string(kUnpacked) + std::string(kUnpacked));
}

TEST_CASE("gunzip: nothing comes out beyond the bound") {
  CHECK(code_of(text_of(kSentence), kUnpacked.size() - 1) == ErrorCode::exhausted);
  CHECK(code_of(text_of(kLetters), 99999) == ErrorCode::exhausted);
  CHECK(code_of(text_of(kSentence) + text_of(kSentence), 2 * kUnpacked.size() - 1) == ErrorCode::exhausted);
  CHECK(code_of(text_of(kSentence), 0) == ErrorCode::exhausted);
}

TEST_CASE("gunzip: what is cut off, damaged or followed by something else is corrupt") {
  const std::string good = text_of(kSentence);
  for (std::size_t length = 0; length < good.size(); ++length) CHECK(code_of(good.substr(0, length)) == ErrorCode::corrupt);
  for (const std::size_t at : {std::size_t{0}, std::size_t{2}, std::size_t{12}, good.size() - 5, good.size() - 1}) {
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    CAPTURE(at);
    CHECK(code_of(damaged) == ErrorCode::corrupt);
  }
  CHECK(code_of(good + "more") == ErrorCode::corrupt);
  CHECK(code_of("A planet has no edge.") == ErrorCode::corrupt);
}

TEST_CASE("is_gzip: knows the first bytes of gzip") {
  CHECK(is_gzip(text_of(kSentence)));
  CHECK_FALSE(is_gzip("PK"));
  CHECK_FALSE(is_gzip(""));
}
