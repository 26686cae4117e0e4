// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "doctor.hpp"

namespace crane {

/// What was looked at on the day of commissioning, kept in a file, so that it can be broken off and
/// gone on with.
struct CommissionItem {
  enum class State { kOpen, kPassed, kFailed };
  struct Picture {
    std::string file, caption;  ///< beside the report
  };
  std::string name;   ///< "calibration"
  std::string title;  ///< for people
  State state = State::kOpen;
  std::string when;  ///< "2026-11-30 21:40:12 UTC"; empty while open
  std::vector<Finding> findings;
  std::vector<Picture> pictures;

  void good(const std::string& what, const std::string& text);
  void warning(const std::string& what, const std::string& text, const std::string& advice);
  void bad(const std::string& what, const std::string& text, const std::string& advice);
  [[nodiscard]] bool any_bad() const;
};

class CommissionBook {
 public:
  /// `folder`: commission/ of the site. A new book where there is none. Error: Configuration, for
  /// one that is damaged.
  static Result<CommissionBook> open(const std::string& folder);

  std::vector<CommissionItem>& items() { return items_; }
  [[nodiscard]] const std::vector<CommissionItem>& items() const { return items_; }
  CommissionItem& item(const std::string& name);
  /// Passed or failed by its findings, now.
  static void close(CommissionItem& item);
  [[nodiscard]] bool all_passed() const;
  /// Writes book.json. Error: Resource.
  [[nodiscard]] Result<void> save() const;

 private:
  explicit CommissionBook(std::string folder) : folder_(std::move(folder)) {}
  std::string folder_;
  std::vector<CommissionItem> items_;
};

}  // namespace crane
