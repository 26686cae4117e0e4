// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/document.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>

#include "config/yaml_strict.hpp"

namespace crane {

const Node* Node::find(const std::string& key) const {
  for (const auto& [name, node] : fields)
    if (name == key) return &node;
  return nullptr;
}

void DocumentReader::problem_at(int line, const std::string& what) {
  problems_.push_back(name_ + (line > 0 ? ":" + std::to_string(line) : "") + ": " + what);
}

void DocumentReader::problem(const std::string& key, const std::string& what) {
  const Node* at = node_.find(key);
  problem_at(at != nullptr ? at->line : node_.line, "'" + key + "' " + what);
}

/// All numbers in a node, lists of lists one after the other. False and a problem: one is none.
bool DocumentReader::flatten(const Node& node, std::vector<double>& out) {
  if (node.text) {
    std::istringstream words(*node.text);
    for (std::string word; words >> word;) {
      const auto number = decimal_number(word);
      if (!number) {
        problem_at(node.line, "'" + word.substr(0, 40) + "' is not a decimal number");
        return false;
      }
      out.push_back(*number);
    }
    return true;
  }
  return std::all_of(node.items.begin(), node.items.end(),
                     [&](const Node& item) { return flatten(item, out); });
}

std::vector<double> DocumentReader::numbers(const std::string& key, std::size_t least,
                                            std::size_t most) {
  const Node* node = node_.find(key);
  std::vector<double> out;
  if (node == nullptr) {
    problem(key, "is missing");
    return {};
  }
  if (!flatten(*node, out)) return {};
  if (out.size() >= least && out.size() <= most) return out;
  problem(key, "has " + std::to_string(out.size()) + " numbers, " + std::to_string(least) +
                   (most > least ? " to " + std::to_string(most) : "") + " are needed");
  return {};
}

double DocumentReader::number(const std::string& key) {
  const auto one = numbers(key, 1, 1);
  return one.empty() ? 0 : one[0];
}

std::vector<double> DocumentReader::matrix(const std::string& key, int rows, int columns) {
  const auto count = static_cast<std::size_t>(rows * columns);
  const Node* node = node_.find(key);
  if (node == nullptr || node->find("data") == nullptr) return numbers(key, count, count);
  DocumentReader inner = section(key);
  for (const auto& [name, size] : {std::pair{"rows", rows}, std::pair{"cols", columns}})
    if (inner.has(name) && inner.number(name) != size)
      inner.problem(name, "of " + key + " is not " + std::to_string(size));
  auto out = inner.numbers("data", count, count);
  take_problems(inner);
  return out;
}

std::vector<double> DocumentReader::vector(const std::string& key,
                                           const std::vector<std::size_t>& counts) {
  const std::size_t least = *std::min_element(counts.begin(), counts.end());
  const std::size_t most = *std::max_element(counts.begin(), counts.end());
  const Node* node = node_.find(key);
  std::vector<double> out;
  if (node == nullptr || node->find("data") == nullptr) {
    out = numbers(key, least, most);
  } else {
    DocumentReader inner = section(key);
    out = inner.numbers("data", least, most);
    take_problems(inner);
  }
  if (!out.empty() && std::find(counts.begin(), counts.end(), out.size()) == counts.end()) {
    std::string wanted;
    for (const std::size_t count : counts)
      wanted += (wanted.empty() ? "" : " or ") + std::to_string(count);
    problem(key, "has " + std::to_string(out.size()) + " numbers, " + wanted + " are needed");
    return {};
  }
  return out;
}

std::string DocumentReader::text(const std::string& key) {
  const Node* node = node_.find(key);
  if (node != nullptr && node->text) return *node->text;
  problem(key, node == nullptr ? "is missing" : "is not a text");
  return "";
}

DocumentReader DocumentReader::section(const std::string& key) {
  const Node* node = node_.find(key);
  if (node != nullptr && !node->text && node->items.empty()) return {*node, name_};
  problem(key, node == nullptr ? "is missing" : "is not a map of keys");
  Node empty;
  empty.line = node == nullptr ? node_.line : node->line;
  return {empty, name_};
}

void DocumentReader::take_problems(DocumentReader& section) {
  problems_.insert(problems_.end(), section.problems_.begin(), section.problems_.end());
  section.problems_.clear();
}

Result<void> DocumentReader::finish() {
  if (problems_.empty()) return {};
  Error error = problems_error(name_, problems_);
  if (error.todo.empty())
    error.todo = "correct the file, or give the one that the calibration wrote";
  return error;
}

}  // namespace crane
