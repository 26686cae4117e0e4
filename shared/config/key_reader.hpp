// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {

/// Values from a file. What is not in it stays as it is; problems are told to the YamlReader.
class KeyReader final : public KeyVisitor {
 public:
  explicit KeyReader(YamlReader& file) : at_{&file} {}

  void number(const Key& key, double& value, const Range& range) override;
  void whole(const Key& key, int& value, const Range& range) override;
  void flag(const Key& key, bool& value) override;
  void text(const Key& key, std::string& value, std::size_t most_bytes) override;
  void texts(const Key& key, std::vector<std::string>& value) override;
  bool one_of(const Key& key, int& index, const std::vector<std::string>& names) override;
  YamlReader* reading() override { return at_.back(); }

 protected:
  bool open(const Key& key, const Use& use) override;
  void close() override;
  std::size_t open_list(const Key& key, std::size_t size, std::size_t most) override;
  void open_item(std::size_t i) override;
  void close_item() override;
  void close_list() override;

 private:
  std::deque<YamlReader> sections_;  ///< those that were opened; known keys are told at the end
  std::vector<std::vector<YamlReader>> lists_;
  std::vector<YamlReader*> at_;
};

}  // namespace crane
