// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <sstream>

#include "calibration_files/document.hpp"

namespace crane {
namespace {

constexpr const char* kBlanks = " \t\r\f\v";

std::string trimmed(const std::string& text) {
  const auto from = text.find_first_not_of(kBlanks);
  if (from == std::string::npos) return "";
  return text.substr(from, text.find_last_not_of(kBlanks) - from + 1);
}

std::string capitals(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

}  // namespace

Result<Node> ini_document(const std::string& whole, const std::string& name) {
  Node root;
  Node* section = nullptr;
  std::istringstream lines(whole.starts_with("\xEF\xBB\xBF") ? whole.substr(3) : whole);
  int line = 0;
  const auto bad = [&](const std::string& what, const std::string& todo) {
    return Error{ErrorCode::kConfiguration, name + ":" + std::to_string(line), what, todo};
  };
  for (std::string raw; std::getline(lines, raw);) {
    ++line;
    const std::string text = trimmed(raw.substr(0, raw.find_first_of(";#")));
    if (text.empty()) continue;
    const auto equals = text.find('=');
    if (text.front() == '[' && text.back() == ']') {
      const std::string title = capitals(trimmed(text.substr(1, text.size() - 2)));
      if (root.find(title) != nullptr)
        return bad("section [" + title + "] stands twice", "keep one of both");
      root.fields.emplace_back(title, Node{line, {}, {}, {}});
      section = &root.fields.back().second;
    } else if (section == nullptr || equals == std::string::npos) {
      return bad("'" + text.substr(0, 40) + "' is neither [SECTION] nor key = value in one",
                 "give the file as the camera's maker has it");
    } else {
      const std::string key = capitals(trimmed(text.substr(0, equals)));
      if (section->find(key) != nullptr) return bad("'" + key + "' stands twice", "keep one");
      section->fields.emplace_back(key, Node{line, trimmed(text.substr(equals + 1)), {}, {}});
    }
  }
  return root;
}

}  // namespace crane
