// Small archives of tiles, made byte by byte or through SQLite and GDAL, for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <sqlite3.h>
#include <unistd.h>

namespace tellurion::test {

/// A folder that goes with its files.
class Folder {
 public:
  explicit Folder(const std::string& name) : path_(std::filesystem::temp_directory_path() / fmt::format("tellurion_{}_{}", name, getpid())) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// The names of what lies in it.
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) names.push_back(entry.path().filename().string());
    return names;
  }

 private:
  std::filesystem::path path_;
};

inline void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// A PNG of `side` x `side` pixels of one colour.
inline std::string plain_png(int side, int red, int green, int blue) {
  GDALAllRegister();
  GDALDatasetUniquePtr memory(GetGDALDriverManager()->GetDriverByName("MEM")->Create("", side, side, 3, GDT_Byte, nullptr));
  REQUIRE(memory);
  const int colour[] = {red, green, blue};
  for (int band = 1; band <= 3; ++band) REQUIRE(memory->GetRasterBand(band)->Fill(colour[band - 1]) == CE_None);
  const char* path = "/vsimem/plain.png";
  GDALClose(GetGDALDriverManager()->GetDriverByName("PNG")->CreateCopy(path, memory.get(), FALSE, nullptr, nullptr, nullptr));
  vsi_l_offset length = 0;
  GByte* data = VSIGetMemFileBuffer(path, &length, TRUE);
  std::string bytes(reinterpret_cast<const char*>(data), static_cast<std::size_t>(length));
  CPLFree(data);
  VSIUnlink("/vsimem/plain.png.aux.xml");
  return bytes;
}

/// A database that is written to.
class Database {
 public:
  explicit Database(const std::filesystem::path& file) { REQUIRE(sqlite3_open(file.c_str(), &database_) == SQLITE_OK); }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void run(const std::string& text) {
    char* message = nullptr;
    const int status = sqlite3_exec(database_, text.c_str(), nullptr, nullptr, &message);
    CAPTURE(text);
    CAPTURE((message ? message : ""));
    REQUIRE(status == SQLITE_OK);
  }
  /// Runs a statement whose only `?` stands for a blob.
  void run(const std::string& text, const std::string& blob) {
    sqlite3_stmt* statement = nullptr;
    REQUIRE(sqlite3_prepare_v2(database_, text.c_str(), -1, &statement, nullptr) == SQLITE_OK);
    sqlite3_bind_blob64(statement, 1, blob.data(), blob.size(), SQLITE_STATIC);
    CHECK(sqlite3_step(statement) == SQLITE_DONE);
    sqlite3_finalize(statement);
  }

 private:
  sqlite3* database_ = nullptr;
};

// --- PMTiles, after the specification ----------------------------------------------------------------------------------

inline std::string varint(std::uint64_t number) {
  std::string bytes;
  for (; number >= 0x80; number >>= 7) bytes += static_cast<char>(0x80 | (number & 0x7f));
  return bytes + static_cast<char>(number);
}

struct PmEntry {
  std::uint64_t tile = 0, run = 1, length = 0, offset = 0;
};

inline std::string pm_directory(const std::vector<PmEntry>& entries) {
  std::string bytes = varint(entries.size());
  std::uint64_t before = 0;
  for (const PmEntry& e : entries) {
    bytes += varint(e.tile - before);
    before = e.tile;
  }
  for (const PmEntry& e : entries) bytes += varint(e.run);
  for (const PmEntry& e : entries) bytes += varint(e.length);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const bool follows = i > 0 && entries[i].offset == entries[i - 1].offset + entries[i - 1].length;
    bytes += varint(follows ? 0 : entries[i].offset + 1);
  }
  return bytes;
}

/// What a header says; the root directory follows it at once.
struct PmArchive {
  std::string root;
  std::string leaves{};
  std::string tiles{};
  std::string metadata{};
  int version = 3, directories = 1, contents = 1, type = 2, min_zoom = 0, max_zoom = 1;

  std::string bytes() const {
    std::string out = "PMTiles";
    const auto put = [&](std::uint64_t value, int size) {
      for (int i = 0; i < size; ++i, value >>= 8) out += static_cast<char>(value & 0xff);
    };
    put(static_cast<std::uint64_t>(version), 1);
    std::uint64_t at = 127;
    const auto range = [&](std::size_t size) {
      put(at, 8);
      put(size, 8);
      at += size;
    };
    range(root.size());
    range(metadata.size());
    range(leaves.size());
    range(tiles.size());
    for (int i = 0; i < 3; ++i) put(0, 8);
    for (const int value : {1, directories, contents, type, min_zoom, max_zoom}) put(static_cast<std::uint64_t>(value), 1);
    for (const int degrees : {-180, -85, 180, 85}) put(static_cast<std::uint32_t>(degrees * 10'000'000), 4);
    put(0, 9);
    return out + root + metadata + leaves + tiles;
  }
};

}  // namespace tellurion::test
