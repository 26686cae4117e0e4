// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/key.hpp"

namespace crane {

/// A visit that wants every value as YAML has it, and what is allowed in words.
class KeyPrinter : public KeyVisitor {
 public:
  void number(const Key& key, double& value, const Range& range) final;
  void whole(const Key& key, int& value, const Range& range) final;
  void flag(const Key& key, bool& value) final;
  void text(const Key& key, std::string& value, std::size_t most_bytes) final;
  void texts(const Key& key, std::vector<std::string>& value) final;
  bool one_of(const Key& key, int& index, const std::vector<std::string>& names) final;

 protected:
  /// In words, and of numbers as numbers.
  struct Allowed {
    std::string words;
    std::optional<Range> range{};
  };
  /// `text`: nothing where there is no value.
  virtual void value(const Key& key, const std::optional<std::string>& text,
                     const Allowed& allowed) = 0;
};

}  // namespace crane
