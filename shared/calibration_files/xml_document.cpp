// SPDX-License-Identifier: Apache-2.0
#include <tinyxml2.h>

#include "calibration_files/document.hpp"

namespace crane {
namespace {

Node node_of(const tinyxml2::XMLElement& from) {
  Node out;
  out.line = from.GetLineNum();
  for (const auto* child = from.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement())
    out.fields.emplace_back(child->Name(), node_of(*child));
  if (out.fields.empty()) out.text = from.GetText() == nullptr ? "" : from.GetText();
  return out;
}

}  // namespace

Result<Node> xml_document(const std::string& text, const std::string& name) {
  tinyxml2::XMLDocument file;  // refuses what is nested deeper than a hundred levels itself
  if (file.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    return Error{ErrorCode::kConfiguration, name + ":" + std::to_string(file.ErrorLineNum()),
                 "is not XML", "give the file that OpenCV's FileStorage wrote"};
  if (file.RootElement() == nullptr || std::string(file.RootElement()->Name()) != "opencv_storage")
    return Error{ErrorCode::kConfiguration, name, "has no <opencv_storage>",
                 "give the file that OpenCV's FileStorage wrote"};
  return node_of(*file.RootElement());
}

}  // namespace crane
