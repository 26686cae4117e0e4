// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/key_printer.hpp"

namespace crane {

/// All values as a YAML file that KeyReader reads back as the same.
class KeyWriter final : public KeyPrinter {
 public:
  [[nodiscard]] const std::string& yaml() const { return out_; }

 protected:
  void value(const Key& key, const std::optional<std::string>& text,
             const Allowed& allowed) override;
  bool open(const Key& key, const Use& use) override;
  void close() override;
  std::size_t open_list(const Key& key, std::size_t size, std::size_t most) override;
  void open_item(std::size_t i) override;
  void close_item() override;
  void close_list() override;

 private:
  void name(const Key& key);

  std::string out_, indent_;
  std::vector<bool> one_line_;           ///< of the lists that are open
  bool item_begins_ = false;             ///< of a list: its first key stands behind the dash
  bool in_line_ = false, first_ = true;  ///< within an item on one line
};

}  // namespace crane
