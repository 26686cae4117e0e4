// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "base/result.hpp"

namespace crane {

/// What only the technician knows: from a file (--answers), from what was said before, or asked in
/// the terminal.
class Answers {
 public:
  /// `file`: YAML, may be empty; `kept`: where answers are remembered, for when it is gone on with.
  /// Error: Configuration, with every unknown key and its line.
  static Result<Answers> open(const std::string& file, const std::string& kept);

  /// Error: Configuration, where nobody is there to be asked, or says nothing; NotAvailable when
  /// the terminal was closed: it is broken off.
  Result<std::string> text(const std::string& key);
  Result<double> number(const std::string& key, double least, double most);
  /// Waits for Enter; without a terminal goes on at once.
  Result<void> ready(const std::string& what);
  /// After a failure, in a terminal only: whether to try once more.
  [[nodiscard]] bool again();
  /// What was said is not kept: it was wrong.
  void forget(const std::string& key);
  [[nodiscard]] bool interactive() const { return terminal_; }

 private:
  Result<void> keep() const;
  std::map<std::string, std::string> said_;
  std::string kept_;
  bool terminal_ = false;
};

}  // namespace crane
