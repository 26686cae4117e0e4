// SPDX-License-Identifier: Apache-2.0
#include "config/key_reader.hpp"

namespace crane {

void KeyReader::number(const Key& key, double& value, const Range& range) {
  const double before = value;
  reading()->number(key.name, value, range.least, range.most, key.is_required);
  if (range.rule.holds == nullptr || range.rule.holds(value)) return;
  reading()->problem(key.name, std::string("must be ") + range.rule.words);
  value = before;
}

void KeyReader::whole(const Key& key, int& value, const Range& range) {
  const int before = value;
  reading()->integer(key.name, value, static_cast<int>(range.least), static_cast<int>(range.most),
                     key.is_required);
  if (range.rule.holds == nullptr || range.rule.holds(value)) return;
  reading()->problem(key.name, std::string("must be ") + range.rule.words);
  value = before;
}

void KeyReader::flag(const Key& key, bool& value) {
  reading()->flag(key.name, value);
}

void KeyReader::text(const Key& key, std::string& value, std::size_t most_bytes) {
  reading()->text(key.name, value, key.is_required);
  if (value.size() > most_bytes)
    reading()->problem(key.name, "has more than " + std::to_string(most_bytes) + " characters");
}

void KeyReader::texts(const Key& key, std::vector<std::string>& value) {
  reading()->texts(key.name, value);
}

bool KeyReader::one_of(const Key& key, int& index, const std::vector<std::string>& names) {
  return reading()->choice(key.name, names, index, key.is_required);
}

bool KeyReader::open(const Key& key, const Use& use) {
  if (!use.used) {
    if (reading()->has(key.name)) reading()->problem(key.name, "is for " + use.when);
    return false;
  }
  sections_.push_back(reading()->section(key.name, key.is_required));
  at_.push_back(&sections_.back());
  return true;
}

void KeyReader::close() {
  at_.pop_back();
}

std::size_t KeyReader::open_list(const Key& key, std::size_t /*size*/, std::size_t most) {
  lists_.push_back(reading()->items(key.name));
  if (lists_.back().size() > most)
    reading()->problem(key.name, "are more than " + std::to_string(most));
  return lists_.back().size();
}

void KeyReader::open_item(std::size_t i) {
  at_.push_back(&lists_.back()[i]);
}

void KeyReader::close_item() {
  at_.pop_back();
}

void KeyReader::close_list() {
  lists_.pop_back();
}

}  // namespace crane
