// SPDX-License-Identifier: Apache-2.0
#include "config/key_list.hpp"

namespace crane {

KeyRow KeyList::row(const Key& key) const {
  KeyRow r;
  r.path = paths_.back() + key.name;
  r.unit = key.unit;
  r.text = key.text;
  r.default_words = key.default_words;
  r.is_required = key.is_required;
  return r;
}

void KeyList::value(const Key& key, const std::optional<std::string>& text,
                    const Allowed& allowed) {
  rows_.push_back(row(key));
  rows_.back().allowed = allowed.words;
  rows_.back().range = allowed.range;
  rows_.back().value = text.value_or("");
}

bool KeyList::open(const Key& key, const Use& use) {
  if (!use.used && !keys_only_) return false;
  rows_.push_back(row(key));
  rows_.back().is_section = true;
  rows_.back().when = use.when;
  paths_.push_back(rows_.back().path + ".");
  return true;
}

void KeyList::close() {
  paths_.pop_back();
}

std::size_t KeyList::open_list(const Key& key, std::size_t size, std::size_t most) {
  lists_.push_back(paths_.back() + key.name);
  if (keys_only_) {
    rows_.push_back(row(key));
    rows_.back().path += "[]";
    rows_.back().allowed = "list of at most " + std::to_string(most);
    rows_.back().is_section = true;
  }
  return keys_only_ ? 1 : size;
}

void KeyList::open_item(std::size_t i) {
  paths_.push_back(lists_.back() + (keys_only_ ? "[]." : "[" + std::to_string(i) + "]."));
}

void KeyList::close_item() {
  paths_.pop_back();
}

void KeyList::close_list() {
  lists_.pop_back();
}

}  // namespace crane
