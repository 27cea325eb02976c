#include "source/tiles/pmtiles.h"

#include <string>

#include <doctest/doctest.h>

#include "source/made_archive.h"

using namespace tellurion;
using namespace tellurion::source;
using namespace tellurion::source::pmtiles;
using test::PmArchive;
using test::PmEntry;
using test::pm_directory;
using test::varint;

TEST_CASE("number_of: as the specification counts") {
  // The examples of the specification (version 3, 4.1) and of the reference implementation's tests.
  CHECK(number_of({0, 0, 0}) == 0);
  CHECK(number_of({1, 0, 0}) == 1);
  CHECK(number_of({1, 0, 1}) == 2);
  CHECK(number_of({1, 1, 1}) == 3);
  CHECK(number_of({1, 1, 0}) == 4);
  CHECK(number_of({2, 0, 0}) == 5);
  CHECK(number_of({12, 3423, 1763}) == 19'078'479);
  // Neighbours in number are neighbours on the map, and each tile has its own number.
  std::vector<TileAddress> by_number(256);
  for (int column = 0; column < 16; ++column) {
    for (int row = 0; row < 16; ++row) by_number.at(number_of({4, column, row}) - 85) = {4, column, row};
  }
  for (std::size_t i = 1; i < by_number.size(); ++i) {
    CHECK(by_number[i].zoom == 4);
    CHECK(std::abs(by_number[i].column - by_number[i - 1].column) + std::abs(by_number[i].row - by_number[i - 1].row) == 1);
  }
  CHECK(number_of({26, (1 << 26) - 1, 0}) == ((std::uint64_t{1} << 54) - 1) / 3 - 1);
}

TEST_CASE("read_directory: lines as they were written, and the tile's line found") {
  const std::string bytes = pm_directory({{0, 1, 100, 0}, {1, 3, 200, 100}, {6, 0, 50, 7}, {300, 2, 1, 1'000'000'000'000}});
  const auto directory = read_directory(bytes, Compression::none);
  REQUIRE(directory);
  REQUIRE(directory->size() == 4);
  CHECK((*directory)[1].offset == 100);
  CHECK((*directory)[3].offset == 1'000'000'000'000);
  CHECK(find(*directory, 0)->length == 100);
  CHECK(find(*directory, 3)->offset == 100);
  CHECK_FALSE(find(*directory, 4));
  CHECK(find(*directory, 6)->tiles == 0);
  CHECK_MESSAGE(find(*directory, 299)->first_tile == 6, "a further directory holds all up to the next line");
  CHECK(find(*directory, 301));
  CHECK_FALSE(find(*directory, 302));
  const auto later = read_directory(pm_directory({{5, 1, 1, 0}}), Compression::none);
  CHECK_FALSE(find(*later, 4));
}

TEST_CASE("read_directory: what is no directory is refused") {
  const std::string good = pm_directory({{0, 1, 100, 0}, {1, 3, 200, 100}});
  for (std::size_t length = 0; length < good.size(); ++length) CHECK_FALSE(read_directory(good.substr(0, length), Compression::none));
  for (const std::string& bytes : {varint(0), varint(1ull << 60), varint(3) + std::string(9, '\1'), varint(1) + std::string(20, '\xff'),
                                   pm_directory({{3, 1, 0, 0}}), varint(1) + "\1\1\1" + varint(0), pm_directory({{3, 1, 1, 0}, {3, 1, 1, 1}})}) {
    const auto read = read_directory(bytes, Compression::none);
    REQUIRE_FALSE(read);
    CHECK(read.error().code == ErrorCode::corrupt);
  }
  CHECK_FALSE(read_directory(good, Compression::gzip));
  // Numbers of tiles beyond 64 bits.
  const std::string most = varint(~0ull);
  CHECK_FALSE(read_directory(varint(2) + most + "\1" + "\1\1" + "\1\1" + "\1\1", Compression::none));
}

TEST_CASE("read_header: what the archive says, and why it is not read") {
  PmArchive made{.root = pm_directory({{0, 1, 4, 0}}), .tiles = "tile"};
  const std::string bytes = made.bytes();
  const auto header = read_header(bytes, bytes.size());
  REQUIRE(header);
  CHECK(header->root == fetch::ByteRange{127, made.root.size()});
  CHECK(header->tiles == fetch::ByteRange{127 + made.root.size(), 4});
  CHECK(header->max_zoom == 1);
  CHECK(header->bounds[1] == doctest::Approx(-85.0));
  CHECK(place_of({0, 1, 4, 0}, *header)->offset == header->tiles.offset);
  CHECK_FALSE(place_of({0, 1, 5, 0}, *header));
  CHECK_FALSE(place_of({0, 1, 1, ~0ull}, *header));
  CHECK_FALSE(place_of({0, 0, 1, 0}, *header));

  for (std::size_t length = 0; length < bytes.size(); ++length) CHECK_FALSE(read_header(bytes.substr(0, length), length));
  // Fewer bytes at hand than the archive has.
  CHECK_FALSE(read_header(bytes.substr(0, kHeaderBytes), bytes.size()));
  CHECK_FALSE(read_header(bytes.substr(0, kHeaderBytes + made.root.size() - 1), bytes.size()));
  CHECK(read_header(bytes.substr(0, kHeaderBytes + made.root.size()), bytes.size()));
  const auto refused = [](PmArchive archive, ErrorCode code, const char* word) {
    const std::string b = archive.bytes();
    const auto read = read_header(b, b.size());
    REQUIRE_FALSE(read);
    CHECK(read.error().code == code);
    CAPTURE(read.error().message);
    CHECK(read.error().message.find(word) != std::string::npos);
  };
  const auto with = [&](auto change) {
    PmArchive other = made;
    change(other);
    return other;
  };
  refused(with([](auto& a) { a.version = 2; }), ErrorCode::unsupported, "version 2");
  refused(with([](auto& a) { a.type = 1; }), ErrorCode::unsupported, "vector");
  refused(with([](auto& a) { a.contents = 3; }), ErrorCode::unsupported, "brotli");
  refused(with([](auto& a) { a.directories = 4; }), ErrorCode::unsupported, "zstd");
  refused(with([](auto& a) { a.directories = 0; }), ErrorCode::corrupt, "compressed");
  refused(with([](auto& a) { a.max_zoom = 27; }), ErrorCode::corrupt, "zooms");
  refused(with([](auto& a) { a.min_zoom = 2; }), ErrorCode::corrupt, "zooms");
  refused(with([](auto& a) { a.root = std::string(20'000, 'x'); }), ErrorCode::corrupt, "beyond");
}
