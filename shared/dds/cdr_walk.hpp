// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "dds/items.hpp"

namespace crane::dds {

// What InPlaceSample::walk() is walked with. Plain CDR (XCDR1): members aligned to their size,
// counted from the first one; a sequence is its length and its values.

static_assert(std::endian::native == std::endian::little, "payloads are written as they are held");

/// Bytes of what is walked.
class CdrSize {
 public:
  template <class Number>
  void number(const Number& /*value*/) {
    at_ = (at_ + sizeof(Number) - 1) / sizeof(Number) * sizeof(Number) + sizeof(Number);
  }
  template <class T>
  void items(const Items<T>& values, std::size_t /*most*/) {
    number(std::uint32_t{});
    at_ += values.size() * sizeof(T);
  }
  [[nodiscard]] std::size_t bytes() const { return at_; }

 private:
  static_assert(sizeof(float) == sizeof(std::uint32_t), "values follow their length unaligned");
  std::size_t at_ = 0;
};

/// Takes values into memory of their own.
struct CdrOwn {
  template <class Number>
  void number(const Number& /*value*/) {}
  template <class T>
  void items(Items<T>& values, std::size_t /*most*/) {
    values.own();
  }
};

/// Writes members. Values that stand where they belong are left; with `lay_out` none is written,
/// but told to stand there.
class CdrWriter {
 public:
  explicit CdrWriter(std::uint8_t* body, bool lay_out = false) : body_(body), lay_out_(lay_out) {}

  template <class Number>
  void number(const Number& value) {
    for (; at_ % sizeof(Number) != 0; ++at_) body_[at_] = 0;
    std::memcpy(body_ + at_, &value, sizeof(Number));
    at_ += sizeof(Number);
  }
  template <class T>
  void items(Items<T>& values, std::size_t /*most*/) {
    number(static_cast<std::uint32_t>(values.size()));
    T* here = reinterpret_cast<T*>(body_ + at_);
    if (lay_out_)
      values.point_at(here, values.size());
    else if (values.data() != here && !values.empty())
      std::memcpy(here, values.data(), values.size() * sizeof(T));
    at_ += values.size() * sizeof(T);
  }

 private:
  std::uint8_t* body_;
  bool lay_out_;
  std::size_t at_ = 0;
};

/// Reads members of somebody else's making: never beyond `bytes`.
class CdrReader {
 public:
  CdrReader(std::uint8_t* body, std::size_t bytes, bool big_endian)
      : body_(body), bytes_(bytes), swap_(big_endian) {}

  template <class Number>
  void number(Number& value) {
    const std::size_t at = (at_ + sizeof(Number) - 1) / sizeof(Number) * sizeof(Number);
    if (flaw_ != nullptr || at > bytes_ || bytes_ - at < sizeof(Number)) return fail("is cut off");
    std::uint8_t raw[sizeof(Number)];
    std::memcpy(raw, body_ + at, sizeof(Number));
    if (swap_) std::reverse(raw, raw + sizeof(Number));
    std::memcpy(&value, raw, sizeof(Number));
    at_ = at + sizeof(Number);
  }
  template <class T>
  void items(Items<T>& values, std::size_t most) {
    std::uint32_t size = 0;
    number(size);
    if (flaw_ != nullptr) return;
    if (size > most) return fail("has a longer sequence than its bound");
    if ((bytes_ - at_) / sizeof(T) < size) return fail("is cut off");
    if (sizeof(T) > 1 && (swap_ || reinterpret_cast<std::uintptr_t>(body_ + at_) % alignof(T) != 0))
      return fail("has values of the other byte order");
    values.point_at(reinterpret_cast<T*>(body_ + at_), size);
    at_ += size * sizeof(T);
  }
  /// nullptr: all is there.
  [[nodiscard]] const char* flaw() const { return flaw_; }

 private:
  void fail(const char* why) {
    if (flaw_ == nullptr) flaw_ = why;
  }

  std::uint8_t* body_;
  std::size_t bytes_, at_ = 0;
  bool swap_;
  const char* flaw_ = nullptr;
};

}  // namespace crane::dds
