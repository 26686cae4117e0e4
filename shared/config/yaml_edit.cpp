// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_edit.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <vector>

namespace crane {
namespace {

/// Bytes of the text that others take the place of.
struct Edit {
  std::size_t from = 0, length = 0;
  std::string text;
};

class Editor {
 public:
  explicit Editor(const std::string& text) : text_(text), root_(YAML::Load(text)) {
    line_starts_.push_back(text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') line_starts_.push_back(i + 1);
  }

  /// "rangefinders[0].scale"; false: the file's shape does not allow it.
  bool set(const std::string& path, const std::string& value) {
    YAML::Node at = root_;
    for (std::size_t from = 0;;) {
      const std::size_t end = path.find_first_of(".[", from);
      const std::string name = path.substr(from, end - from);
      const bool is_key = end == std::string::npos;
      const bool in_root = from == 0;
      if (!at.IsMap() && !(in_root && at.IsNull())) return false;
      const YAML::Node parent = at;  // reading must not make what is not there
      const YAML::Node found = at.IsMap() ? parent[name] : YAML::Node(YAML::NodeType::Undefined);
      if (!found.IsDefined()) {
        if (!in_root) return is_key && put_into(parent, name + ": " + value);
        const std::string rest = is_key ? name : path.substr(end + 1);
        if (!is_key && (path[end] == '[' || rest.find_first_of(".[") != std::string::npos))
          return false;
        new_sections_[is_key ? "" : name].push_back(rest + ": " + value);
        return true;
      }
      at.reset(found);
      if (is_key) return replace(at, value);
      from = end + 1;
      if (path[end] != '[') continue;
      const std::size_t close = path.find(']', end);
      const std::size_t item = std::stoul(path.substr(end + 1, close - end - 1));
      if (!at.IsSequence() || item >= at.size()) return false;
      at.reset(at[item]);
      from = close + 2;
    }
  }

  std::string done() {
    if (root_.IsMap() && root_.Style() == YAML::EmitterStyle::Flow) {
      for (const auto& [section, lines] : new_sections_) {
        std::string entry;
        for (const std::string& line : lines) entry += (entry.empty() ? "" : ", ") + line;
        put_into(root_, section.empty() ? entry : section + ": {" + entry + "}");
      }
      new_sections_.clear();
    }
    std::string out = text_;
    std::stable_sort(edits_.begin(), edits_.end(),
                     [](const Edit& a, const Edit& b) { return a.from > b.from; });
    for (const Edit& e : edits_) out.replace(e.from, e.length, e.text);
    if (new_sections_.empty()) return out;
    if (!out.empty() && out.back() != '\n') out += "\n";
    for (const auto& [section, lines] : new_sections_) {
      if (!section.empty()) out += section + ":\n";
      for (const std::string& line : lines) out += (section.empty() ? "" : "  ") + line + "\n";
    }
    return out;
  }

 private:
  [[nodiscard]] std::size_t place(const YAML::Node& node) const {
    const YAML::Mark mark = node.Mark();
    if (mark.is_null() || std::size_t(mark.line) >= line_starts_.size()) return text_.size();
    return std::min(text_.size(), line_starts_[std::size_t(mark.line)] + std::size_t(mark.column));
  }

  bool replace(const YAML::Node& node, const std::string& value) {
    if (!node.IsScalar()) return false;
    const std::size_t from = place(node);
    std::size_t length = node.Scalar().size();
    const char quote = from < text_.size() ? text_[from] : '\0';
    if (quote == '\'' || quote == '"') {
      const std::size_t end = text_.find(quote, from + 1);
      if (end == std::string::npos) return false;
      length = end + 1 - from;
    } else if (text_.compare(from, length, node.Scalar()) != 0) {
      return false;
    }
    edits_.push_back({from, length, value});
    return true;
  }

  /// First in a section.
  bool put_into(const YAML::Node& section, const std::string& entry) {
    if (section.Style() == YAML::EmitterStyle::Flow) {
      const std::size_t from = place(section);
      if (from >= text_.size() || text_[from] != '{') return false;
      edits_.push_back({from + 1, 0, entry + (section.size() > 0 ? ", " : "")});
      return true;
    }
    if (section.size() == 0) return false;
    const YAML::Node first = section.begin()->first;
    const std::string indent(std::size_t(first.Mark().column), ' ');
    edits_.push_back({place(first), 0, entry + "\n" + indent});
    return true;
  }

  const std::string& text_;
  YAML::Node root_;
  std::vector<std::size_t> line_starts_;
  std::vector<Edit> edits_;
  std::map<std::string, std::vector<std::string>> new_sections_;
};

Error unchangeable(const std::string& name, const std::string& what) {
  return {ErrorCode::kConfiguration, name, "cannot be changed and keep its comments: " + what,
          "write each section as an indented block of 'key: value' lines"};
}

}  // namespace

Result<std::string> with_values(const std::string& text, const std::string& name,
                                const SiteConfig& wanted) {
  const auto before = parse_site_config(text, name);
  if (!before) return before.error();
  std::map<std::string, std::string> values;
  for (const KeyRow& row : values_of(wanted)) values[row.path] = row.value;
  try {
    Editor editor(text);
    for (const std::string& path : changed_keys(wanted, *before))
      if (!values.contains(path) || !editor.set(path, values[path]))
        return unchangeable(name, path);
    const std::string out = editor.done();
    const auto after = parse_site_config(out, name);
    if (!after) return unchangeable(name, after.error().text());
    if (const auto off = changed_keys(*after, wanted); !off.empty())
      return unchangeable(name, off.front());
    return out;
  } catch (const YAML::Exception& e) {
    return unchangeable(name, e.what());
  }
}

}  // namespace crane
