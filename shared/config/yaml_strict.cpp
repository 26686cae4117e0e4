// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_strict.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <vector>

#include "base/utf8.hpp"

namespace crane {
namespace {

constexpr std::size_t kMaxDepth = 100, kMostProblems = 20;

std::string line_of(const YAML::Mark& mark) {
  return std::to_string(mark.line + 1);
}

/// Follows the parser through a text, before a tree is made of it.
class StrictEvents final : public YAML::EventHandler {
 public:
  explicit StrictEvents(std::string name) : name_(std::move(name)) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 2)
      add(mark, "a second document begins here ('---'): one file, one document");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override { scalar(mark, ""); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    add(mark, "an alias ('*name') is not supported: write the value out");
    scalar(mark, "*");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& value) override {
    scalar(mark, value);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/,
                       YAML::anchor_t /*anchor*/, YAML::EmitterStyle::value /*style*/) override {
    enter(mark, false);
  }
  void OnSequenceEnd() override { levels_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {
    enter(mark, true);
  }
  void OnMapEnd() override { levels_.pop_back(); }

  [[nodiscard]] int documents() const { return documents_; }
  [[nodiscard]] Result<void> result() const {
    if (problems_.empty()) return {};
    return problems_error(name_, problems_);
  }

 private:
  struct Level {
    bool map = false, at_key = true;
    std::string path, key;            ///< of the value that comes next
    std::map<std::string, int> seen;  ///< key: its line
  };

  void add(const YAML::Mark& mark, const std::string& what) {
    if (problems_.size() < kMostProblems)
      problems_.push_back(name_ + ":" + line_of(mark) + ": " + what);
  }

  /// A whole value began where a key was due or was awaited.
  void enter(const YAML::Mark& mark, bool map) {
    if (levels_.size() >= kMaxDepth) throw YAML::ParserException(mark, "too deeply nested");
    std::string path;
    if (!levels_.empty()) {
      Level& above = levels_.back();
      if (above.map && above.at_key) add(mark, "a key is a list or a map");
      path = above.map ? above.path + above.key + "." : above.path;
      if (above.map) above.at_key = !above.at_key;
    }
    levels_.push_back({map, true, path, "", {}});
  }

  void scalar(const YAML::Mark& mark, const std::string& value) {
    if (levels_.empty() || !levels_.back().map) return;
    Level& level = levels_.back();
    if (level.at_key) {
      level.key = value;
      const auto [first, is_new] = level.seen.emplace(value, mark.line + 1);
      if (!is_new)
        add(mark, "'" + level.path + value + "' stands here again, first in line " +
                      std::to_string(first->second) + ": one of them must go");
    }
    level.at_key = !level.at_key;
  }

  std::string name_;
  int documents_ = 0;
  std::vector<Level> levels_;
  std::vector<std::string> problems_;
};

/// A sign, digits, with `real` a point and an exponent; nothing else.
bool is_decimal(const std::string& text, bool real) {
  std::size_t i = !text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0;
  std::size_t digits = 0;
  const auto skip_digits = [&] {
    const std::size_t from = i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    return i - from;
  };
  digits = skip_digits();
  if (real && i < text.size() && text[i] == '.') {
    ++i;
    digits += skip_digits();
  }
  if (digits == 0) return false;
  if (real && i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    ++i;
    if (i < text.size() && (text[i] == '-' || text[i] == '+')) ++i;
    if (skip_digits() == 0) return false;
  }
  return i == text.size();
}

template <class T>
std::optional<T> parsed(const std::string& text, bool real) {
  if (!is_decimal(text, real)) return std::nullopt;
  const char* from = text.data() + (text[0] == '+' ? 1 : 0);
  T value{};
  const auto [end, failed] = std::from_chars(from, text.data() + text.size(), value);
  if (failed != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Error problems_error(const std::string& name, const std::vector<std::string>& problems) {
  // The first stands in the line of the log that tools look for.
  std::string all;
  for (const std::string& p : problems) all += (all.empty() ? " " : "\n  ") + p;
  return {ErrorCode::kConfiguration, name, std::to_string(problems.size()) + " problem(s):" + all,
          "correct them and start again; nothing was changed"};
}

Result<void> check_strict_yaml(const std::string& text, const std::string& name) {
  if (const std::size_t bad = first_not_utf8(text); bad != std::string::npos) {
    const auto lines = std::count(text.begin(), text.begin() + std::ptrdiff_t(bad), '\n');
    return Error{ErrorCode::kConfiguration, name + ":" + std::to_string(lines + 1),
                 "holds bytes that are not UTF-8", "save the file as UTF-8"};
  }
  StrictEvents events(name);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    // No further: at some broken ends yaml-cpp 0.7 begins one empty document after another.
    while (events.documents() < 2 && parser.HandleNextDocument(events)) {
    }
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kConfiguration, name + ":" + line_of(e.mark), e.msg,
                 "correct the YAML syntax"};
  }
  return events.result();
}

std::optional<double> decimal_number(const std::string& text) {
  const auto value = parsed<double>(text, true);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int> decimal_integer(const std::string& text) {
  return parsed<int>(text, false);
}

std::optional<bool> yes_or_no(const std::string& text) {
  std::string low = text;
  for (char& c : low)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  std::string rest = text.empty() ? text : text.substr(1);
  const bool capitals = std::none_of(rest.begin(), rest.end(), [](char c) { return c >= 'a'; });
  if (low != text && !capitals && low.substr(1) != rest) return std::nullopt;  // as in 'tRue'
  if (low == "true" || low == "yes" || low == "on") return true;
  if (low == "false" || low == "no" || low == "off") return false;
  return std::nullopt;
}

}  // namespace crane
