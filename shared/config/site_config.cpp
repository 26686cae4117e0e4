// SPDX-License-Identifier: Apache-2.0
#include "config/site_config.hpp"

#include <map>
#include <set>

#include "config/key_list.hpp"
#include "config/key_reader.hpp"
#include "config/key_writer.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

Result<SiteConfig> read(Result<YamlReader> file) {
  if (!file) return file.error();
  SiteConfig config;
  KeyReader reader(*file);
  keys(reader, config);
  if (auto done = file->finish(); !done) return done.error();
  return config;
}

}  // namespace

void keys(KeyVisitor& v, SiteConfig& c) {
  v.integer({"crane", "number of the crane: its DDS partition"}, c.crane, {1, 1'000'000});
  v.section({"dds", "how processes find and reach each other"}, c.dds);
  v.section({"http", "where services answer over HTTP"}, c.http);
  v.section({"gateway", "the page for operators and integrators, and its API"}, c.gateway);
  v.section({"camera", "where pairs of images come from"}, c.camera);
  v.section({"stereo", "how depth is found in a pair"}, c.stereo);
  v.section({"mapper", "how clouds become a map, and what positions mean"}, c.mapper);
  v.section({"hoist", "rope, hook and load, which topic hoist_state places"}, c.hoist);
  keys(v, c.rangefinders);
  v.section({"watchdog",
             "does what the camera sees agree with calibration and positions? From drifting on it "
             "is said; from wrong on nothing is mapped and the map is not valid"},
            c.watchdog);
  keys(v, c.zones);
}

Result<SiteConfig> read_site_config(const std::string& path) {
  return read(YamlReader::from_file(path));
}

Result<SiteConfig> parse_site_config(const std::string& text, const std::string& name) {
  return read(YamlReader::from_text(text, name));
}

std::string to_yaml(const SiteConfig& config) {
  SiteConfig copy = config;
  KeyWriter writer;
  keys(writer, copy);
  return writer.yaml();
}

std::vector<KeyRow> values_of(SiteConfig config) {
  KeyList list(KeyList::Of::kValues);
  keys(list, config);
  return list.rows();
}

std::vector<std::string> changed_keys(const SiteConfig& one, const SiteConfig& other) {
  std::map<std::string, std::string> before;
  for (const KeyRow& row : values_of(other)) before[row.path] = row.value;
  std::vector<std::string> changed;
  for (const KeyRow& row : values_of(one)) {
    const auto found = before.find(row.path);
    if (found == before.end() || found->second != row.value) changed.push_back(row.path);
    if (found != before.end()) before.erase(found);
  }
  for (const auto& [path, value] : before) changed.push_back(path);
  return changed;
}

}  // namespace crane
