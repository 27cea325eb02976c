// Shared read-only data.
#pragma once

#include <memory>
#include <utility>

namespace tellurion {

/// A shared pointer to data that nobody can change any more: made only from a unique owner.
template <class T>
class Frozen {
 public:
  Frozen() = default;
  explicit Frozen(std::unique_ptr<T> owner) : data_(std::move(owner)) {}

  explicit operator bool() const { return data_ != nullptr; }
  const T& operator*() const { return *data_; }
  const T* operator->() const { return data_.get(); }
  const T* get() const { return data_.get(); }

 private:
  std::shared_ptr<const T> data_;
};

/// Freezes a value.
template <class T>
Frozen<T> freeze(T value) {
  return Frozen<T>(std::make_unique<T>(std::move(value)));
}

}  // namespace tellurion
