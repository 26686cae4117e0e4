// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// A file of keys and values, whatever it is written in.
struct Node {
  int line = 0;                                      ///< from 1; 0 = not known
  std::optional<std::string> text;                   ///< of a value; numbers are not yet read
  std::vector<std::pair<std::string, Node>> fields;  ///< of a map, in the order of the file
  std::vector<Node> items;                           ///< of a list

  [[nodiscard]] const Node* find(const std::string& key) const;
};

// Each takes a file's text and its name for errors. Error: Configuration, with the line. None
// recurses deeper than a hundred levels, whatever the text.
Result<Node> yaml_document(const std::string& text, const std::string& name);
Result<Node> xml_document(const std::string& text, const std::string& name);
/// Sections are fields of the whole, in capitals; keys too.
Result<Node> ini_document(const std::string& text, const std::string& name);
/// One Python literal: dicts, lists, tuples, strings, bytes, numbers.
Result<Node> python_document(const std::string& text, const std::string& name);

/// Reads typed values out of a document and collects all problems, each with file and line. What
/// nobody asks for is left alone: these files are of others and carry more than a calibration.
class DocumentReader {
 public:
  DocumentReader(const Node& node, std::string name) : node_(node), name_(std::move(name)) {}

  [[nodiscard]] bool has(const std::string& key) const { return node_.find(key) != nullptr; }
  /// 0 and a problem when it is missing or no decimal number. A decimal comma is no number.
  double number(const std::string& key);
  /// So many numbers, in one list or in a list of lists, or apart by blanks; empty and a problem
  /// otherwise.
  std::vector<double> numbers(const std::string& key, std::size_t least, std::size_t most);
  /// `rows` x `columns` numbers row by row, of {rows, cols, data} (OpenCV, ROS, EuRoC) or of a list
  /// of rows (Kalibr).
  std::vector<double> matrix(const std::string& key, int rows, int columns);
  /// As matrix(), one row or one column of any of the `counts`.
  std::vector<double> vector(const std::string& key, const std::vector<std::size_t>& counts);
  std::string text(const std::string& key);
  /// A map below; an empty one and a problem when there is none.
  DocumentReader section(const std::string& key);

  void problem(const std::string& key, const std::string& what);
  /// Problems of a section are told with those of the whole.
  void take_problems(DocumentReader& section);
  /// Error: Configuration, all problems and what to do.
  Result<void> finish();

 private:
  bool flatten(const Node& node, std::vector<double>& out);
  void problem_at(int line, const std::string& what);

  Node node_;
  std::string name_;
  std::vector<std::string> problems_;
};

}  // namespace crane
