// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_reader.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <optional>
#include <set>
#include <sstream>

#include "base/read_file.hpp"
#include "config/nearest_name.hpp"
#include "config/yaml_strict.hpp"

namespace crane {
namespace {

constexpr std::size_t kMaxBytes = 1U << 20U;

/// A text that C strings and one line of a log can hold.
std::optional<std::string> plain_text(const std::string& text) {
  if (text.find('\0') != std::string::npos) return std::nullopt;
  return text;
}

std::string number_text(double v) {
  std::ostringstream s;
  s << v;
  return s.str();
}

}  // namespace

struct YamlReader::Shared {
  std::string name;
  std::vector<std::string> problems;
  struct Checked {
    YAML::Node node;
    std::string path;
    std::shared_ptr<std::set<std::string>> known;
  };
  std::vector<Checked> maps;  ///< every map that was read, to find unknown keys

  void add(int line, const std::string& what) {
    problems.push_back(name + (line >= 0 ? ":" + std::to_string(line + 1) : "") + ": " + what);
  }
};

struct YamlReader::Impl {
  std::shared_ptr<Shared> shared;
  YAML::Node node;  ///< a map, or undefined
  std::string path;
  std::shared_ptr<std::set<std::string>> known = std::make_shared<std::set<std::string>>();

  YAML::Node get(const std::string& key) const {
    known->insert(key);
    if (!node.IsDefined() || !node.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
    return node[key];
  }
  std::string full(const std::string& key) const { return path.empty() ? key : path + "." + key; }
  void missing(const std::string& key) const {
    shared->add(node.IsDefined() ? node.Mark().line : -1, "'" + full(key) + "' is missing");
  }
  void wrong(const YAML::Node& value, const std::string& key, const std::string& what) const {
    shared->add(value.Mark().line, "'" + full(key) + "' " + what);
  }
  /// The value where there is one. A key left empty is no value: the default would be a guess.
  std::optional<YAML::Node> value_of(const std::string& key, const char* kind,
                                     bool required) const {
    YAML::Node value = get(key);
    if (!value.IsDefined()) {
      if (required) missing(key);
      return std::nullopt;
    }
    if (!value.IsNull()) return value;
    wrong(value, key, std::string("has no value: write ") + kind + ", or leave the key out");
    return std::nullopt;
  }
  template <class Parse>
  auto read(const std::string& key, const char* kind, bool required, Parse parse) const
      -> decltype(parse(std::string())) {
    const auto value = value_of(key, kind, required);
    if (!value) return std::nullopt;
    auto out = value->IsScalar() ? parse(value->Scalar()) : std::nullopt;
    if (!out) wrong(*value, key, not_a(kind, *value));
    return out;
  }
  template <class Parse>
  auto read_list(const std::string& key, const char* kind, bool required, Parse parse) const
      -> std::optional<std::vector<typename decltype(parse(std::string()))::value_type>> {
    const auto value = value_of(key, kind, required);
    if (!value) return std::nullopt;
    std::vector<typename decltype(parse(std::string()))::value_type> out;
    if (!value->IsSequence()) {
      wrong(*value, key, not_a(kind, *value));
      return std::nullopt;
    }
    for (const YAML::Node& item : *value) {
      const auto one = item.IsScalar() ? parse(item.Scalar()) : std::nullopt;
      if (!one) {
        wrong(item, key, not_a(kind, item));
        return std::nullopt;
      }
      out.push_back(*one);
    }
    return out;
  }
  static std::string not_a(const char* kind, const YAML::Node& value) {
    std::string text = std::string("is not ") + kind;
    if (value.IsScalar()) text += ": '" + value.Scalar().substr(0, 40) + "'";
    return text;
  }
};

YamlReader::YamlReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {
  if (impl_->node.IsDefined() && impl_->node.IsMap())
    impl_->shared->maps.push_back({impl_->node, impl_->path, impl_->known});
}
YamlReader::~YamlReader() = default;
YamlReader::YamlReader(YamlReader&&) noexcept = default;
YamlReader& YamlReader::operator=(YamlReader&&) noexcept = default;

Result<YamlReader> YamlReader::from_file(const std::string& path) {
  auto text = read_file(path, kMaxBytes);
  if (text) return from_text(*text, path);
  Error error = text.error();
  if (error.code != ErrorCode::kResource) error.code = ErrorCode::kConfiguration;
  return error;
}

Result<YamlReader> YamlReader::from_text(const std::string& whole, const std::string& name) {
  // OpenCV's first line, which many calibrations have, is no directive that YAML knows.
  constexpr std::string_view kOpencv = "%YAML:1.0";
  const bool opencv = whole.starts_with(kOpencv);
  const std::string text = opencv ? "#" + whole.substr(kOpencv.size()) : whole;
  auto impl = std::make_unique<Impl>();
  impl->shared = std::make_shared<Shared>();
  impl->shared->name = name;
  // yaml-cpp recurses once per nesting level: an input of brackets only would exhaust the stack.
  // (Block nesting and what hides in quotes is counted by check_strict_yaml.)
  std::size_t depth = 0;
  std::size_t deepest = 0;
  for (char c : text) {
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if ((c == ']' || c == '}') && depth > 0) --depth;
  }
  if (text.size() > kMaxBytes || deepest > 100)
    return Error{ErrorCode::kConfiguration, name, "too large or too deeply nested", ""};
  if (auto strict = check_strict_yaml(text, name); !strict) return strict.error();
  try {
    impl->node = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kConfiguration, name + ":" + std::to_string(e.mark.line + 1), e.msg,
                 "correct the YAML syntax"};
  }
  if (!impl->node.IsMap() && !impl->node.IsNull())
    return Error{ErrorCode::kConfiguration, name, "is not a map of keys",
                 "write 'key: value' lines"};
  return YamlReader(std::move(impl));
}

YamlReader YamlReader::section(const std::string& key, bool required) {
  auto impl = std::make_unique<Impl>();
  impl->shared = impl_->shared;
  impl->path = impl_->full(key);
  const YAML::Node value = impl_->get(key);
  if (value.IsDefined() && value.IsMap()) {
    impl->node = value;
  } else {
    impl->node = YAML::Node(YAML::NodeType::Undefined);
    if (value.IsDefined() && !value.IsNull())
      impl_->shared->add(value.Mark().line, "'" + impl->path + "' is not a map of keys");
    else if (required)
      impl_->missing(key);
  }
  return YamlReader(std::move(impl));
}

std::vector<YamlReader> YamlReader::items(const std::string& key) {
  std::vector<YamlReader> out;
  const YAML::Node value = impl_->get(key);
  if (!value.IsDefined() || value.IsNull()) return out;
  if (!value.IsSequence()) {
    impl_->shared->add(value.Mark().line, "'" + impl_->full(key) + "' is not a list");
    return out;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    auto impl = std::make_unique<Impl>();
    impl->shared = impl_->shared;
    impl->path = impl_->full(key) + "[" + std::to_string(i) + "]";
    impl->node = value[i];
    if (!impl->node.IsMap())
      impl_->shared->add(impl->node.Mark().line, "'" + impl->path + "' is not a map of keys");
    out.push_back(YamlReader(std::move(impl)));
  }
  return out;
}

void YamlReader::number(const std::string& key, double& out, double min, double max,
                        bool required) {
  const auto value = impl_->read(key, "a number", required, decimal_number);
  if (!value) return;
  if (!(*value >= min && *value <= max))
    problem(key,
            number_text(*value) + " is outside " + number_text(min) + " .. " + number_text(max));
  else
    out = *value;
}

void YamlReader::integer(const std::string& key, int& out, int min, int max, bool required) {
  const auto value = impl_->read(key, "a whole number", required, decimal_integer);
  if (!value) return;
  if (*value < min || *value > max)
    problem(key, std::to_string(*value) + " is outside " + std::to_string(min) + " .. " +
                     std::to_string(max));
  else
    out = *value;
}

void YamlReader::flag(const std::string& key, bool& out) {
  if (const auto value = impl_->read(key, "true or false", false, yes_or_no)) out = *value;
}

void YamlReader::text(const std::string& key, std::string& out, bool required) {
  if (auto value = impl_->read(key, "a text", required, plain_text)) out = std::move(*value);
}

void YamlReader::texts(const std::string& key, std::vector<std::string>& out) {
  if (auto value = impl_->read_list(key, "a list of texts", false, plain_text))
    out = std::move(*value);
}

bool YamlReader::choice(const std::string& key, const std::vector<std::string>& choices, int& out,
                        bool required) {
  std::string all;
  for (const std::string& choice : choices) all += (all.empty() ? "" : ", ") + choice;
  if (required && !has(key)) {
    problem(key, "is missing; one of: " + all);
    return false;
  }
  if (!has(key)) return true;
  const auto value = impl_->read(key, "a text", false, plain_text);
  if (!value) return false;
  const auto found = std::find(choices.begin(), choices.end(), *value);
  if (found == choices.end())
    problem(key, "'" + *value + "' is none of: " + all);
  else
    out = static_cast<int>(found - choices.begin());
  return found != choices.end();
}

void YamlReader::numbers(const std::string& key, std::vector<double>& out, std::size_t count,
                         bool required) {
  numbers(key, out, count, count, required);
}

void YamlReader::numbers(const std::string& key, std::vector<double>& out, std::size_t least,
                         std::size_t most, bool required) {
  auto values = impl_->read_list(key, "a list of numbers", required, decimal_number);
  if (!values) return;
  const std::string wanted =
      std::to_string(least) + (most > least ? " to " + std::to_string(most) : "");
  if (values->size() < least || values->size() > most)
    problem(key, "has " + std::to_string(values->size()) + " numbers, " + wanted + " are needed");
  else
    out = std::move(*values);
}

bool YamlReader::has(const std::string& key) const {
  return impl_->get(key).IsDefined();
}

void YamlReader::ignore(const std::string& key) {
  impl_->known->insert(key);
}

void YamlReader::problem(const std::string& key, const std::string& what) {
  const YAML::Node value = impl_->get(key);
  const YAML::Node& at = value.IsDefined() ? value : impl_->node;
  impl_->shared->add(at.IsDefined() ? at.Mark().line : -1, "'" + impl_->full(key) + "' " + what);
}

Result<void> YamlReader::finish() {
  Shared& shared = *impl_->shared;
  for (const auto& [node, path, known] : shared.maps)
    for (const auto& entry : node) {
      std::string key;
      if (entry.first.IsScalar()) key = entry.first.Scalar();
      if (known->contains(key)) continue;
      std::string all;
      for (const std::string& k : *known) all += (all.empty() ? "" : ", ") + k;
      const std::string meant = nearest_name(key, *known);
      shared.add(entry.first.Mark().line, "unknown key '" +
                                              (path.empty() ? key : path + "." + key) + "' (" +
                                              (meant.empty() ? "" : "'" + meant + "' is meant? ") +
                                              "known here: " + all + ")");
    }
  shared.maps.clear();
  if (shared.problems.empty()) return {};
  return problems_error(shared.name, shared.problems);
}

}  // namespace crane
