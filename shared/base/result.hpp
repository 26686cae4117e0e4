// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "base/expects.hpp"

namespace crane {

/// Why an expected failure happened; decides the exit code of a service.
enum class ErrorCode {
  kConfiguration,  ///< what the user wrote is wrong: exit 2
  kResource,       ///< memory, disk, network, permission: exit 3
  kBadData,        ///< a recording, file or sample that breaks its format
  kWrongSize,      ///< two things that must fit do not
  kNotAvailable,   ///< asked for something that is not there (yet)
};

/// What went wrong, where, and what the reader can do about it.
struct Error {
  ErrorCode code = ErrorCode::kBadData;
  std::string where;  ///< a file with its line, a topic, a device
  std::string what;   ///< the fact
  std::string todo;   ///< the way out; may be empty

  [[nodiscard]] std::string text() const {
    return where + (where.empty() ? "" : ": ") + what + (todo.empty() ? "" : " -> " + todo);
  }
};

/// A value or an Error. Reading the value of a failed result is a bug.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }
  [[nodiscard]] const Error& error() const {
    expects(!ok(), "error() of a good result");
    return std::get<Error>(state_);
  }
  [[nodiscard]] T& value() & {
    expects(ok(), "value() of a failed result");
    return std::get<T>(state_);
  }
  [[nodiscard]] const T& value() const& {
    expects(ok(), "value() of a failed result");
    return std::get<T>(state_);
  }
  [[nodiscard]] T&& value() && {
    expects(ok(), "value() of a failed result");
    return std::get<T>(std::move(state_));
  }
  T&& operator*() && { return std::move(*this).value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  [[nodiscard]] bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  [[nodiscard]] const Error& error() const {
    expects(!ok(), "error() of a good result");
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace crane
