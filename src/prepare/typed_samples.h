// Samples as values of a C++ type.
// Thread-safe: pure functions.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "prepare/samples.h"

namespace tellurion::prepare {

/// Calls `work` with a value of the C++ type that `type` names.
template <class Work>
auto with_type(SampleType type, Work&& work) {
  switch (type) {
    case SampleType::u8:
      return work(std::uint8_t{});
    case SampleType::u16:
      return work(std::uint16_t{});
    case SampleType::i16:
      return work(std::int16_t{});
    case SampleType::u32:
      return work(std::uint32_t{});
    case SampleType::i32:
      return work(std::int32_t{});
    case SampleType::f32:
      return work(float{});
    case SampleType::f64:
      break;
  }
  return work(double{});
}

template <class T>
const T* as(const Samples& samples) {
  return reinterpret_cast<const T*>(samples.bytes.data());
}
template <class T>
T* as(Samples& samples) {
  return reinterpret_cast<T*>(samples.bytes.data());
}

/// Tells voids from values, in the samples' own type.
template <class T>
class Voids {
 public:
  explicit Voids(const SampleLayout& layout) {
    if (!layout.no_data || std::isnan(*layout.no_data)) return;
    if constexpr (std::is_floating_point_v<T>) {
      has_value_ = true;
      value_ = static_cast<T>(*layout.no_data);
    } else {
      has_value_ = *layout.no_data >= static_cast<double>(std::numeric_limits<T>::lowest()) && *layout.no_data <= static_cast<double>(std::numeric_limits<T>::max()) &&
                   std::floor(*layout.no_data) == *layout.no_data;
      if (has_value_) value_ = static_cast<T>(*layout.no_data);
    }
  }

  bool has_value() const { return has_value_; }
  T value() const { return has_value_ ? value_ : fallback(); }
  bool contains(T sample) const {
    if constexpr (std::is_floating_point_v<T>) {
      if (std::isnan(sample)) return true;
    }
    return has_value_ && sample == value_;
  }

 private:
  static T fallback() {
    if constexpr (std::is_floating_point_v<T>) return std::numeric_limits<T>::quiet_NaN();
    else return T{0};
  }

  bool has_value_ = false;
  T value_{};
};

}  // namespace tellurion::prepare
