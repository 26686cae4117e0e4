// SPDX-License-Identifier: Apache-2.0
#include "config/key_writer.hpp"

namespace crane {

void KeyWriter::name(const Key& key) {
  if (in_line_)
    out_ += first_ ? "" : ", ";
  else if (item_begins_)
    out_ += indent_.substr(2) + "- ";
  else
    out_ += indent_;
  first_ = item_begins_ = false;
  out_ += key.name + ":";
}

void KeyWriter::value(const Key& key, const std::optional<std::string>& text,
                      const Allowed& /*allowed*/) {
  if (!text) return;
  name(key);
  out_ += " " + *text + (in_line_ ? "" : "\n");
}

bool KeyWriter::open(const Key& key, const Use& use) {
  if (!use.used) return false;
  name(key);
  out_ += "\n";
  indent_ += "  ";
  return true;
}

void KeyWriter::close() {
  indent_.resize(indent_.size() - 2);
}

std::size_t KeyWriter::open_list(const Key& key, std::size_t size, std::size_t /*most*/) {
  one_line_.push_back(key.one_line);
  if (size == 0) return 0;
  name(key);
  out_ += "\n";
  return size;
}

void KeyWriter::open_item(std::size_t /*i*/) {
  if (one_line_.back()) {
    out_ += indent_ + "  - {";
    in_line_ = first_ = true;
  } else {
    indent_ += "    ";
    item_begins_ = true;
  }
}

void KeyWriter::close_item() {
  if (in_line_)
    out_ += "}\n";
  else
    indent_.resize(indent_.size() - 4);
  in_line_ = item_begins_ = false;
}

void KeyWriter::close_list() {
  one_line_.pop_back();
}

}  // namespace crane
