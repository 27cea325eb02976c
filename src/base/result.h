// Success or failure as a value.
// Shaped after std::expected (C++23), so that it can be replaced by it.
#pragma once

#include <cassert>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace tellurion {

/// What a caller can do about a failure; the message says the rest.
enum class ErrorCode {
  invalid_argument,  ///< the request makes no sense: do not repeat it
  not_found,         ///< the thing named is not there
  unavailable,       ///< may work later: retry
  corrupt,           ///< the bytes are wrong: retrying cannot help
  unsupported,       ///< right bytes, but nothing that we read
  cancelled,         ///< nobody wants the answer any more
  pending,           ///< on its way: ask again once it is there
  exhausted,         ///< a bound (memory, size, count) was reached
  internal,          ///< a library failed in a way that it did not explain
};

/// The stable lower-case name of `code`.
constexpr const char* name_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return "invalid argument";
    case ErrorCode::not_found:
      return "not found";
    case ErrorCode::unavailable:
      return "unavailable";
    case ErrorCode::corrupt:
      return "corrupt";
    case ErrorCode::unsupported:
      return "unsupported";
    case ErrorCode::cancelled:
      return "cancelled";
    case ErrorCode::pending:
      return "pending";
    case ErrorCode::exhausted:
      return "exhausted";
    case ErrorCode::internal:
      return "internal";
  }
  return "unknown";
}

/// A failure: what it is, and one line that names the file, line or URL and what to do.
struct [[nodiscard]] Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;
};

/// A `T` or an `Error`. Asking for the one that is not there is a programmer's mistake (asserted).
template <class T>
class [[nodiscard]] Result {
 public:
  using value_type = T;

  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}
  Result(ErrorCode code, std::string message) : state_(std::in_place_index<1>, Error{code, std::move(message)}) {}

  bool has_value() const { return state_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  T& value() & { return checked<0>(); }
  const T& value() const& { return const_cast<Result*>(this)->template checked<0>(); }
  T&& value() && { return std::move(checked<0>()); }
  const Error& error() const { return const_cast<Result*>(this)->template checked<1>(); }

  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  T value_or(T fallback) && { return has_value() ? std::move(*this).value() : std::move(fallback); }

 private:
  template <std::size_t I>
  auto& checked() {
    assert(state_.index() == I);
    return *std::get_if<I>(&state_);
  }

  std::variant<T, Error> state_;
};

/// Success without a value, or an `Error`.
template <>
class [[nodiscard]] Result<void> {
 public:
  using value_type = void;

  Result() = default;
  Result(Error error) : failed_(true), error_(std::move(error)) {}
  Result(ErrorCode code, std::string message) : Result(Error{code, std::move(message)}) {}

  bool has_value() const { return !failed_; }
  explicit operator bool() const { return !failed_; }
  const Error& error() const {
    assert(failed_);
    return error_;
  }

 private:
  bool failed_ = false;
  Error error_;
};

}  // namespace tellurion
