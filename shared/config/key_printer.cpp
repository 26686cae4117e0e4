// SPDX-License-Identifier: Apache-2.0
#include "config/key_printer.hpp"

#include "config/yaml_text.hpp"

namespace crane {
namespace {

template <class Number>
std::string words(const Range& range, std::string (*print)(Number)) {
  if (range.rule.says_all) return range.rule.words;
  std::string out =
      print(static_cast<Number>(range.least)) + " .. " + print(static_cast<Number>(range.most));
  if (range.rule.words != nullptr) out += std::string(", ") + range.rule.words;
  return out;
}

std::string joined(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += (out.empty() ? "" : ", ") + item;
  return out;
}

}  // namespace

void KeyPrinter::number(const Key& key, double& number, const Range& range) {
  value(key, yaml_exact(number), {words<double>(range, yaml_exact), range});
}

void KeyPrinter::whole(const Key& key, int& number, const Range& range) {
  value(key, std::to_string(number), {words<int>(range, std::to_string), range});
}

void KeyPrinter::flag(const Key& key, bool& set) {
  value(key, set ? "true" : "false", {"true, false"});
}

void KeyPrinter::text(const Key& key, std::string& text, std::size_t most_bytes) {
  const bool any = most_bytes == kAnyLength;
  value(key, yaml_quoted(text),
        {any ? "text" : "text to " + std::to_string(most_bytes) + " characters"});
}

void KeyPrinter::texts(const Key& key, std::vector<std::string>& texts) {
  std::vector<std::string> quoted;
  for (const std::string& text : texts) quoted.push_back(yaml_quoted(text));
  value(key, "[" + joined(quoted) + "]", {"list of texts"});
}

bool KeyPrinter::one_of(const Key& key, int& index, const std::vector<std::string>& names) {
  std::optional<std::string> text;
  if (index >= 0 && std::size_t(index) < names.size()) text = names[std::size_t(index)];
  value(key, text, {joined(names)});
  return true;
}

}  // namespace crane
