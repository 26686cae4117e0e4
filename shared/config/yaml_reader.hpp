// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// Reads a YAML file into typed values and collects *all* problems with file and line.
///
/// A key that nobody asked for is a problem, and so is one without a value or one that stands
/// twice (yaml_strict.hpp says what else). Nothing is repaired: after the last read, finish()
/// returns the whole list as one error. Hostile input is fine: no exception leaves.
class YamlReader {
 public:
  /// Error: Configuration when the file is missing, too big (1 MiB), or not YAML.
  static Result<YamlReader> from_file(const std::string& path);
  static Result<YamlReader> from_text(const std::string& text, const std::string& name);

  ~YamlReader();
  YamlReader(YamlReader&&) noexcept;
  YamlReader& operator=(YamlReader&&) noexcept;

  /// A nested map; an empty one when absent (a problem if required).
  YamlReader section(const std::string& key, bool required = false);
  /// Items of a sequence of maps; none when absent.
  std::vector<YamlReader> items(const std::string& key);

  // Each leaves `out` as it is when the key is absent (a problem if required) or wrong (a problem).
  void number(const std::string& key, double& out, double min, double max, bool required = false);
  void integer(const std::string& key, int& out, int min, int max, bool required = false);
  void flag(const std::string& key, bool& out);
  void text(const std::string& key, std::string& out, bool required = false);
  void texts(const std::string& key, std::vector<std::string>& out);
  /// One of `choices`; `out` becomes its index. False: it is none of them, or missing.
  bool choice(const std::string& key, const std::vector<std::string>& choices, int& out,
              bool required = false);
  /// Exactly `count` finite numbers.
  void numbers(const std::string& key, std::vector<double>& out, std::size_t count,
               bool required = false);
  /// From `least` to `most` finite numbers.
  void numbers(const std::string& key, std::vector<double>& out, std::size_t least,
               std::size_t most, bool required);
  /// Whether the key is there.
  [[nodiscard]] bool has(const std::string& key) const;
  /// Known, but of no use to us: not a problem.
  void ignore(const std::string& key);
  /// Any problem the caller finds, at this key's line; of a key that is not there, its section's.
  void problem(const std::string& key, const std::string& what);

  /// Unknown keys and all problems so far, of this reader and its sections.
  Result<void> finish();

 private:
  struct Shared;
  struct Impl;
  explicit YamlReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane
