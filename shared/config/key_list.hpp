// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/key_printer.hpp"

namespace crane {

/// A key as a list has it: all that is said of it, and its value.
struct KeyRow {
  std::string path;  ///< "mapper.voxel_m", "zones[0].id"
  std::string unit, allowed, text;
  std::optional<Range> range;  ///< of a number
  std::string value;           ///< as YAML has it; empty: none
  std::string default_words;
  std::string when;  ///< of a section that is not always of use
  bool is_section = false, is_required = false;
};

/// Every key of a visit, in the order of the file.
class KeyList final : public KeyPrinter {
 public:
  enum class Of {
    kValues,  ///< what there is: items of lists, sections that are of use
    kKeys,    ///< what there may be: one item of each list, "zones[]", and all sections
  };
  explicit KeyList(Of of) : keys_only_(of == Of::kKeys) {}
  [[nodiscard]] const std::vector<KeyRow>& rows() const { return rows_; }

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
  [[nodiscard]] KeyRow row(const Key& key) const;

  bool keys_only_;
  std::vector<std::string> paths_ = {""};  ///< "mapper.", innermost last
  std::vector<std::string> lists_;         ///< "zones"
  std::vector<KeyRow> rows_;
};

}  // namespace crane
