// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "base/expects.hpp"

namespace crane::dds {

/// The values of a sequence: where a payload has them, or in memory of their own. What is const
/// shows const values.
template <class T>
class Items {
 public:
  Items() = default;
  Items(const Items&) = delete;
  Items& operator=(const Items&) = delete;

  /// Memory of their own from now on, zeros where there was none.
  void resize(std::size_t size) {
    own_.resize(size);
    point_at(own_.data(), size);
  }
  /// Whose memory `data` is outlives the use of this.
  void point_at(T* data, std::size_t size) {
    data_ = data;
    size_ = size;
  }
  /// The same values in memory of their own.
  void own() {
    if (data_ == own_.data()) return;
    own_.assign(data_, data_ + size_);
    data_ = own_.data();
  }
  void shrink(std::size_t size) {
    expects(size <= size_, "shrinks");
    size_ = size;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] const T* begin() const { return data_; }
  [[nodiscard]] const T* end() const { return data_ + size_; }
  [[nodiscard]] const T& front() const { return *data_; }
  [[nodiscard]] const T& back() const { return data_[size_ - 1]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  T* data() { return data_; }
  T& operator[](std::size_t i) { return data_[i]; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::vector<T> own_;
};

}  // namespace crane::dds
