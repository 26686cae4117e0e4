// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

#include <cctype>
#include <string_view>

#include "calibration_files/document.hpp"
#include "config/yaml_strict.hpp"

namespace crane {
namespace {

/// OpenCV's first line is no directive that YAML knows, and after it OpenCV takes 'key:value' for a
/// key and its value, as many of its files have it. Lines stay where they are.
std::string as_yaml(const std::string& text) {
  constexpr std::string_view kLine = "%YAML:1.0";
  if (!text.starts_with(kLine)) return text;
  std::string out = "#";
  bool at_key = false;  ///< so far the line is blanks and a key
  bool begun = false;
  for (std::size_t i = kLine.size(); i < text.size(); ++i) {
    const char c = text[i];
    out += c;
    if (c == '\n') {
      at_key = true;
      begun = false;
    } else if (c == ':' && at_key && begun) {
      at_key = false;
      if (i + 1 < text.size() && text[i + 1] != ' ') out += ' ';
    } else if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.') {
      begun = true;
    } else if (c != ' ' || begun) {
      at_key = false;
    }
  }
  return out;
}

Node node_of(const YAML::Node& from) {
  Node out;
  out.line = from.Mark().line + 1;
  if (from.IsScalar()) out.text = from.Scalar();
  if (from.IsSequence())
    for (const YAML::Node& item : from) out.items.push_back(node_of(item));
  if (from.IsMap())
    for (const auto& entry : from)
      out.fields.emplace_back(entry.first.IsScalar() ? entry.first.Scalar() : "",
                              node_of(entry.second));
  return out;
}

}  // namespace

Result<Node> yaml_document(const std::string& whole, const std::string& name) {
  const std::string text = as_yaml(whole);
  std::size_t depth = 0;
  for (const char c : text) {  // yaml-cpp recurses once per bracket
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (depth > 100)
      return Error{ErrorCode::kConfiguration, name, "is too deeply nested",
                   "give the file that the calibration wrote"};
  }
  if (auto strict = check_strict_yaml(text, name); !strict) return strict.error();
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsMap()) return node_of(root);
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kConfiguration, name + ":" + std::to_string(e.mark.line + 1), e.msg,
                 "correct the YAML syntax"};
  }
  return Error{ErrorCode::kConfiguration, name, "is not a map of keys",
               "give the file that the calibration wrote"};
}

}  // namespace crane
