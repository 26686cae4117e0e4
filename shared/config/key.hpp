// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace crane {

class YamlReader;

/// What is said of one key of the configuration. It stands once, in the function keys() of the
/// struct that holds its value; reading, writing, comparing, help and docs/configuration.md are
/// visits of that function.
struct Key {
  /// The unit is that of the name's ending (_m, _ms, _hz, ..).
  Key(const char* called, const char* says);
  /// Where the name does not say the unit.
  [[nodiscard]] Key in(const char* unit_of_it) const;
  [[nodiscard]] Key required() const;
  /// In words, where the default is no fixed value, or what it means is not plain.
  [[nodiscard]] Key by_default(const char* words) const;
  /// Of a list: each item is written on one line.
  [[nodiscard]] Key on_one_line() const;

  std::string name, text, unit, default_words;
  bool is_required = false, one_line = false;
};

/// What else a number must be.
struct Rule {
  const char* words = nullptr;  ///< what it "must be"
  bool (*holds)(double) = nullptr;
  bool says_all = false;  ///< `words` are all that is allowed, ends included
};
inline constexpr Rule kOdd{"odd", [](double v) { return static_cast<int>(v) % 2 != 0; }};
inline constexpr Rule kOneOrMinusOne{"1 or -1", [](double v) { return v == 1 || v == -1; }, true};

/// Both ends are allowed.
struct Range {
  double least, most;
  Rule rule{};
};

/// When a section is of use: then it is read and written, else it is a problem.
struct Use {
  bool used = true;
  std::string when{};  ///< such as "device: modbus"
};

/// One use of all keys. keys() calls it for each, in the order of the file.
class KeyVisitor {
 public:
  static constexpr std::size_t kAnyLength = std::numeric_limits<std::size_t>::max();
  virtual ~KeyVisitor() = default;

  virtual void number(const Key& key, double& value, const Range& range) = 0;
  virtual void whole(const Key& key, int& value, const Range& range) = 0;
  virtual void flag(const Key& key, bool& value) = 0;
  virtual void text(const Key& key, std::string& value, std::size_t most_bytes) = 0;
  virtual void texts(const Key& key, std::vector<std::string>& value) = 0;
  /// `index` of `names`; -1 = none of them, which is not written. False: a wrong one was read.
  virtual bool one_of(const Key& key, int& index, const std::vector<std::string>& names) = 0;

  void text(const Key& key, std::string& value) { text(key, value, kAnyLength); }
  template <class Int>
  void integer(const Key& key, Int& value, const Range& range) {
    int plain = static_cast<int>(value);
    whole(key, plain, range);
    value = static_cast<Int>(plain);
  }
  /// An enum or bool; `names` as it counts.
  template <class Enum>
  bool choice(const Key& key, Enum& value, const std::vector<std::string>& names) {
    int index = static_cast<int>(value);
    const bool right = one_of(key, index, names);
    value = static_cast<Enum>(index);
    return right;
  }
  /// A map of keys: those of keys(KeyVisitor&, Config&).
  template <class Config>
  void section(const Key& key, Config& config, const Use& use = {}) {
    if (!open(key, use)) return;
    keys(*this, config);
    close();
  }
  /// `check(reader, earlier, item)`: for each item and each one before it, when they are read.
  template <class Config, class Check>
  void list(const Key& key, std::vector<Config>& items, std::size_t most, const Check& check) {
    items.resize(open_list(key, items.size(), most));
    for (std::size_t i = 0; i < items.size(); ++i) {
      open_item(i);
      keys(*this, items[i]);
      if (YamlReader* file = reading(); file != nullptr)
        for (std::size_t k = 0; k < i; ++k) check(*file, items[k], items[i]);
      close_item();
    }
    close_list();
  }
  template <class Config>
  void list(const Key& key, std::vector<Config>& items, std::size_t most) {
    list(key, items, most, [](YamlReader&, const Config&, const Config&) {});
  }

  /// Of the section that is being read, to tell it what does not fit together; nullptr: nothing is
  /// being read.
  virtual YamlReader* reading() { return nullptr; }

 protected:
  /// False: it is left out.
  virtual bool open(const Key& key, const Use& use) = 0;
  virtual void close() = 0;
  /// How many items there are.
  virtual std::size_t open_list(const Key& key, std::size_t size, std::size_t most) = 0;
  virtual void open_item(std::size_t i) = 0;
  virtual void close_item() = 0;
  virtual void close_list() = 0;
};

}  // namespace crane
