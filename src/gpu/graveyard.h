// Names of OpenGL objects whose owners are gone, waiting for the thread that may delete them.
// Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

namespace tellurion::gpu {

enum class ObjectKind : std::uint8_t { buffer, texture, framebuffer, renderbuffer, program, sampler, vertex_array };

class Graveyard {
 public:
  Graveyard() { names_.reserve(kReserved); doomed_.reserve(kReserved); }

  /// From any thread. Forgotten if the context is gone.
  void bury(ObjectKind kind, unsigned name);

  /// Deletes what was buried. Only with the context current.
  void empty();

  /// The context goes, and all its objects with it.
  void close();

  std::size_t size() const;

 private:
  struct Name {
    ObjectKind kind;
    unsigned name;
  };
  static constexpr std::size_t kReserved = 1024;

  mutable std::mutex mutex_;
  std::vector<Name> names_;
  std::vector<Name> doomed_;  // touched by empty() alone
  bool closed_ = false;
};

}  // namespace tellurion::gpu
