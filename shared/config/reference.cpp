// SPDX-License-Identifier: Apache-2.0
#include "config/reference.hpp"

#include <algorithm>
#include <set>

#include "base/expects.hpp"
#include "config/nearest_name.hpp"
#include "config/site_config.hpp"

namespace crane {
namespace {

std::string default_of(const KeyRow& row) {
  if (!row.default_words.empty()) return row.default_words;
  if (row.is_required) return "must be given";
  return row.value == "\"\"" ? "empty" : row.value;
}

/// Of Markdown's tables.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

std::string parent_of(const std::string& path) {
  const auto dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}

std::string sentence(const KeyRow& row) {
  std::string out = row.text;
  if (out[0] >= 'a' && out[0] <= 'z') out[0] = static_cast<char>(out[0] - 'a' + 'A');
  if (!row.when.empty()) out += " (" + row.when + ")";
  if (!row.allowed.empty()) out += "; " + row.allowed;
  return out;
}

/// The keys of a section, without what is in sections below it.
std::string table(const std::vector<KeyRow>& rows, const std::string& section) {
  std::string out;
  for (const KeyRow& row : rows) {
    if (row.is_section || parent_of(row.path) != section) continue;
    if (out.empty()) out = "| Key | Unit | Allowed | Default | Meaning |\n|---|---|---|---|---|\n";
    const std::string name = section.empty() ? row.path : row.path.substr(section.size() + 1);
    out += "| `" + name + "` | " + row.unit + " | " + cell(row.allowed) + " | " +
           cell(default_of(row)) + " | " + cell(row.text) + " |\n";
  }
  return out;
}

bool is_of(const KeyRow& row, const std::string& name) {
  if (name.empty() || row.path == name || row.path == name + "[]") return true;
  return row.path.starts_with(name + ".") || row.path.starts_with(name + "[].");
}

}  // namespace

std::vector<KeyRow> all_keys() {
  SiteConfig defaults;
  KeyList list(KeyList::Of::kKeys);
  keys(list, defaults);
  return list.rows();
}

Range range_of(const std::string& key) {
  const std::vector<KeyRow> rows = all_keys();
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&](const KeyRow& r) { return r.path == key; });
  expects(row != rows.end() && row->range.has_value(), "a key with a range");
  return *row->range;
}

std::string reference_page() {
  const std::vector<KeyRow> rows = all_keys();
  std::string page =
      "# Configuration\n"
      "One YAML file configures all services of one crane. Every key has a default unless it must "
      "be given; a key that does not exist, stands twice\n"
      "or has a wrong value is an error with its line, and nothing starts. `cranemap config "
      "--config FILE` shows the effective configuration, `cranemap\n"
      "config changed --config FILE` what differs from the defaults, `cranemap config describe "
      "mapper.voxel_m` what a key is.\n\n"
      "This page is made from the descriptions in `shared/config`, and a test compares both. To "
      "make it anew: `build/release/bin/cranemap config reference >\n"
      "docs/configuration.md`.\n\n";
  page += table(rows, "");
  for (const KeyRow& row : rows) {
    if (!row.is_section) continue;
    const auto dots = std::count(row.path.begin(), row.path.end(), '.');
    page += "\n" + std::string(std::size_t(dots) + 2, '#') + " " + row.path + "\n";
    page += sentence(row) + ".\n\n" + table(rows, row.path);
  }
  return page;
}

Result<std::string> described(const std::string& name) {
  std::string out;
  std::set<std::string> names;
  for (const KeyRow& row : all_keys()) {
    names.insert(row.path);
    if (!is_of(row, name)) continue;
    out += row.path + (row.unit.empty() ? "" : " [" + row.unit + "]") + ": " + row.text + "\n";
    if (!row.when.empty()) out += "    of use: " + row.when + "\n";
    if (!row.allowed.empty()) out += "    allowed: " + row.allowed + "\n";
    if (!row.is_section) out += "    default: " + default_of(row) + "\n";
  }
  if (!out.empty()) return out;
  const std::string meant = nearest_name(name, names);
  return Error{
      ErrorCode::kConfiguration, name, "is no key or section",
      meant.empty() ? "'cranemap config describe' names all" : "'" + meant + "' is meant?"};
}

}  // namespace crane
