// SPDX-License-Identifier: Apache-2.0
#include <yaml-cpp/yaml.h>

#include "calibration_files/document.hpp"
#include "config/yaml_strict.hpp"

namespace crane {
namespace {

/// OpenCV's first line is no directive that YAML knows.
std::string without_opencv_line(std::string text) {
  constexpr std::string_view kLine = "%YAML:1.0";
  if (text.starts_with(kLine)) text.replace(0, kLine.size(), "#");
  return text;
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
  const std::string text = without_opencv_line(whole);
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
