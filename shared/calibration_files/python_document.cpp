// SPDX-License-Identifier: Apache-2.0
#include <string_view>

#include "calibration_files/document.hpp"

namespace crane {
namespace {

constexpr int kDeepest = 50;

/// Recursive descent; `problem` is set once and ends everything.
class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Node whole() {
    Node out = value(0);
    skip();
    if (problem_.empty() && at_ < text_.size()) fail("something follows the closing bracket");
    return out;
  }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] int line() const { return line_; }

 private:
  void fail(const std::string& what) {
    if (problem_.empty()) problem_ = what;
    at_ = text_.size();
  }
  /// The next character; 0 at the end.
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip() {
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '#')
        at_ = std::min(text_.find('\n', at_), text_.size()) - 1;
      else if (c == '\n')
        ++line_;
      else if (c != ' ' && c != '\t' && c != '\r')
        return;
    }
  }
  bool take(char c) {
    skip();
    if (peek() != c) return false;
    ++at_;
    return true;
  }

  Node value(int depth) {
    skip();
    Node out;
    out.line = line_;
    if (depth > kDeepest) {
      fail("is too deeply nested");
    } else if (take('{')) {
      while (problem_.empty() && !take('}')) {
        const Node key = value(depth + 1);
        if (!key.text || !take(':')) {
          fail("a 'key': value is expected here");
          break;
        }
        out.fields.emplace_back(*key.text, value(depth + 1));
        if (!take(',') && (skip(), peek() != '}')) fail("',' or '}' is expected here");
      }
    } else if (peek() == '[' || peek() == '(') {
      const char end = peek() == '[' ? ']' : ')';
      ++at_;
      while (problem_.empty() && !take(end)) {
        out.items.push_back(value(depth + 1));
        if (!take(',') && (skip(), peek() != end)) fail("',' or a closing bracket is expected");
      }
    } else {
      out.text = word();
    }
    return out;
  }

  std::string word() {
    if (peek() == 'b' && at_ + 1 < text_.size() &&
        (text_[at_ + 1] == '\'' || text_[at_ + 1] == '"'))
      ++at_;
    const char quote = peek();
    if (quote == '\'' || quote == '"') {
      const auto end = text_.find(quote, at_ + 1);
      if (end == std::string_view::npos) {
        fail("a string does not end");
        return "";
      }
      std::string out(text_.substr(at_ + 1, end - at_ - 1));
      at_ = end + 1;
      return out;
    }
    const auto end = std::min(text_.find_first_of(" \t\r\n,:]})#", at_), text_.size());
    if (end == at_) {
      fail("a value is expected here");
      return "";
    }
    std::string out(text_.substr(at_, end - at_));
    at_ = end;
    return out;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string problem_;
};

}  // namespace

Result<Node> python_document(const std::string& text, const std::string& name) {
  Parser parser(text);
  Node out = parser.whole();
  if (parser.problem().empty() && !out.fields.empty()) return out;
  return Error{ErrorCode::kConfiguration, name + ":" + std::to_string(parser.line()),
               parser.problem().empty() ? "is not a dictionary" : parser.problem(),
               "give the .cameramodel file as mrcal wrote it"};
}

}  // namespace crane
